#include "gelslam/surface/background_drift.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <opencv2/core.hpp>

#include "../support/pixel_map.hpp"
#include "gelslam/surface/model_file.hpp"

namespace gelslam::test {
namespace {

cv::Mat3f bare_cells() {
  return pixel_map<cv::Vec3f>(kBackgroundGrid, [](int u, int v) {
    const double bump = std::exp(-0.01 * ((u - 10) * (u - 10) + (v - 7) * (v - 7)));
    return cv::Vec3d(60 + 80 * bump, 90 + 30 * bump, 40 + 90 * bump);
  });
}

TEST(Drift, TellsTheLightFromTheGel) {
  const cv::Mat3f then = bare_cells();
  cv::Mat3f now = then.clone();
  for (cv::Vec3f& cell : now) cell = cv::Vec3f(1.3F * cell[0], cell[1], 0.8F * cell[2] + 5.0F);
  const BackgroundDrift drift = measure_drift(then, now);
  EXPECT_NEAR(drift.light_gain[0], 1.3, 0.01);
  EXPECT_NEAR(drift.light_gain[2], 0.8, 0.01);
  EXPECT_TRUE(drift.light_changed);
  EXPECT_FALSE(drift.gel_changed);
}

TEST(Drift, NoticesDirt) {
  const cv::Mat3f then = bare_cells();
  cv::Mat3f now = then.clone();
  now(3, 12) -= cv::Vec3f(45, 45, 45);
  const BackgroundDrift drift = measure_drift(then, now);
  EXPECT_TRUE(drift.gel_changed);
  EXPECT_FALSE(drift.light_changed);
  EXPECT_NEAR(drift.worst_cell_levels, 45.0, 3.0);
}

/// Returns the cells of a gel that becomes brighter to the right and downward.
cv::Mat3f tilted_cells(const cv::Vec3d& per_column, const cv::Vec3d& per_row) {
  const cv::Mat3f cells = bare_cells();
  return pixel_map<cv::Vec3f>(
      kBackgroundGrid, [&](int u, int v) { return cv::Vec3d(cells(v, u)) + u * per_column + v * per_row; });
}

TEST(Drift, NoticesRedAndBlueSwapped) {
  const cv::Mat3f then = tilted_cells({0, 0, 0}, {0, 0, 3});
  cv::Mat3f now = then.clone();
  for (cv::Vec3f& cell : now) cell = cv::Vec3f(1.05F * cell[2], cell[1], cell[0] + 2.0F);
  const BackgroundDrift swapped = measure_drift(then, now);
  EXPECT_EQ(swapped.exchanged, "red and blue");
  EXPECT_THAT(swapped.words, ::testing::HasSubstr("red and blue are swapped"));
  now = then.clone();
  now(3, 12) -= cv::Vec3f(45, 45, 45);
  EXPECT_EQ(measure_drift(then, now).exchanged, "") << "dirt";
  EXPECT_EQ(measure_drift(then, then).exchanged, "");
}

TEST(Drift, NoticesAMirroredPicture) {
  const cv::Mat3f then = tilted_cells({2, 0, 0}, {0, 0, 4});
  for (const auto& [code, what] : {std::pair(1, "left and right are"), std::pair(0, "top and bottom are"),
                                   std::pair(-1, "left and right, and top and bottom, are")}) {
    cv::Mat3f now;
    cv::flip(then, now, code);
    EXPECT_THAT(measure_drift(then, now).difference, ::testing::StartsWith(what));
  }
}

}  // namespace
}  // namespace gelslam::test
