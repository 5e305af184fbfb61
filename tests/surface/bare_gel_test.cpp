#include "heights/bare_gel.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <opencv2/imgproc.hpp>

#include "gelslam/surface/slopes.hpp"
#include "heights/poisson.hpp"
#include "linear_gel.hpp"
#include "photometry/blocks.hpp"

namespace gelslam::test {
namespace {

using namespace surface::detail;

/// What a sensor reads of a height field (in pixels): the slopes times a factor that depends on the column.
struct Reading {
  cv::Mat1f gx, gy;
  cv::Mat1b changed;
};
template <typename Factor>
Reading read(const cv::Mat1f& truth, const Factor& factor_of_column) {
  const auto factor = pixel_map<float>(kSensor, [&](int u, int) { return factor_of_column(u); });
  cv::Mat1f gx, gy, steepness;
  cv::Sobel(truth, gx, CV_32F, 1, 0, 1, 0.5);
  cv::Sobel(truth, gy, CV_32F, 0, 1, 1, 0.5);
  cv::magnitude(gx, gy, steepness);
  return {cv::Mat1f(gx.mul(factor)), cv::Mat1f(gy.mul(factor)), cv::Mat1b(steepness.mul(factor) > 1e-4F)};
}

cv::Mat1b in_blocks(const cv::Mat1b& pixels) {
  cv::Mat1b blocks;
  surface::detail::gather_blocks(pixels, blocks);
  return blocks;
}

constexpr double kBorrowedModel = 3.6;  // Surface::slope_sigma_ratio

/// Heights in pixels that were integrated from slopes and corrected by BareGelLeveler.
struct Leveled {
  cv::Mat1f height;
  bool seen = false;
};
Leveled leveled(const Reading& reading, BareGelLeveler& leveler) {
  PoissonSolver poisson(kSensor);
  cv::Mat1f squares = poisson.solve(reading.gx, reading.gy);
  const bool seen = leveler.level(squares, in_blocks(reading.changed), poisson).seen;
  return {poisson.pixels(squares), seen};
}
Leveled leveled(const Reading& reading) {
  BareGelLeveler leveler({kSensor, kPitchMm}, {}, 1, kBorrowedModel);
  return leveled(reading, leveler);
}

/// A rod across the picture: a parabola that is `half_width` pixels wide to each side.
double trench_px(int u, double center, double half_width, double depth) {
  const double x = (u - center) / half_width;
  return -depth * std::max(0.0, 1 - x * x);
}

// A rod lies from the upper to the lower border, 1 mm deep, and its right flank is read 20 % too flat.
// Nevertheless the gel on both sides must be recognized as bare and get the height 0.
TEST(BareGel, LiesAtZeroOnBothSidesOfAContactThatSpansThePicture) {
  const double depth = 1.0 / kPitchMm;
  const cv::Mat1f truth = pixel_map<float>(kSensor, [&](int u, int) { return trench_px(u, 160, 60, depth); });
  const Reading reading = read(truth, [](int u) { return u > 160 ? 0.8 : 1.0; });
  const auto [height, seen] = leveled(reading);
  EXPECT_TRUE(seen);
  for (int v = 0; v < kSensor.height; v += 20)
    for (int u = 0; u < kSensor.width; u += 4) {
      if (reading.changed(v, u) == 0 && (u < 96 || u > 224)) {
        EXPECT_NEAR(kPitchMm * height(v, u), 0.0, 0.02) << u << " " << v;
      }
    }
  // The error, 0.2 of the depth, is distributed over both flanks, so half of it remains at the deepest line.
  EXPECT_NEAR(kPitchMm * height(120, 160), -0.9, 0.03);
}

// The same rod lies near the border of the gel, where the model is less accurate, so the error is attributed
// to the flank there.
TEST(BareGel, ErrorsAreSpreadWhereSlopesAreLeastCertain) {
  const double depth = 1.0 / kPitchMm;
  const cv::Mat1f truth = pixel_map<float>(kSensor, [&](int u, int) { return trench_px(u, 250, 45, depth); });
  const Reading reading = read(truth, [](int u) { return u > 250 ? 0.8 : 1.0; });
  const cv::Mat1b confidence = confidence_map(default_uncertainty(kSensor, kPitchMm), kSensor);
  const auto deepest_mm = [&](const cv::Mat1b& known) {
    BareGelLeveler leveler({kSensor, kPitchMm}, known, 1, kBorrowedModel);
    return kPitchMm * leveled(reading, leveler).height(120, 250);
  };
  EXPECT_LT(std::abs(deepest_mm(confidence) + 1.0), 0.5 * std::abs(deepest_mm(cv::Mat1b()) + 1.0));
}

/// A coin whose field lies 4 pixels below bare gel, and whose rim lies deeper, so that the gel falls from the
/// field to the rim.
cv::Mat1f coin_px(cv::Point center, double radius) {
  return pixel_map<float>(kSensor, [&](int u, int v) {
    const double r = std::hypot(u - center.x, v - center.y);
    const double face = -4.0 * std::clamp((radius - r) / 8, 0.0, 1.0);
    return face - 4.0 * std::max(0.0, 1 - std::abs(r - radius + 20) / 10);
  });
}

TEST(BareGel, AFieldInsideARaisedRimIsNotBare) {
  // The second coin leaves only 3 % of the picture bare, in a corner.
  for (const auto& [center, radius] : {std::pair(cv::Point(160, 120), 105), {cv::Point(120, 80), 189}}) {
    const Reading reading = read(coin_px(center, radius), [](int) { return 1.0; });
    ASSERT_EQ(reading.changed(center), 0);
    const auto [height, seen] = leveled(reading);
    EXPECT_TRUE(seen);
    EXPECT_NEAR(height(center), -4, 0.1);
    EXPECT_NEAR(height(230, 310), 0, 0.1);
  }
}

// A finger reaches in from the upper border, and a model of another sensor reads its right flank far too
// steep. The integration therefore lifts the gel on that side. But around the tip the slopes connect both
// sides, so the lower one, which is larger, must not be taken for a pressed face.
TEST(BareGel, OnBothSidesOfAContactIsOneWhereSlopesAroundItSaySo) {
  for (const double factor : {1.8, 2.4}) {
    const cv::Mat1f truth = pixel_map<float>(kSensor, [](int u, int v) {
      const double x = (u - 225) / 45.0, y = std::max(0, v - 150) / 50.0;
      return -10 * std::max(0.0, 1 - x * x - y * y);
    });
    Reading reading = read(truth, [&](int u) { return u > 225 ? factor : 1.0; });
    const cv::Mat1f integrated = PoissonSolver(kSensor).solve(reading.gx, reading.gy);
    EXPECT_GT(integrated(20, 150) - integrated(20, 20), 5) << "what integration alone makes of it";
    // A narrow strip beyond the tip has changed color, too, so the two sides are not connected by unchanged
    // gel.
    reading.changed(cv::Rect(200, 190, 60, 50)).setTo(255);
    const auto [height, seen] = leveled(reading);
    EXPECT_TRUE(seen);
    EXPECT_NEAR(height(120, 60), 0, 0.1) << factor;
    EXPECT_NEAR(height(40, 310), 0, 0.2) << factor;
  }
}

/// If the depth of a field is just at the limit, and each frame decided by itself, one frame would take it
/// for bare and the next for pressed.
TEST(BareGel, StaysBareOrPressedWhileHeightsHardlyChange) {
  const auto fields_height = [](BareGelLeveler& leveler, double depth) {
    const cv::Mat1f truth = pixel_map<float>(kSensor, [&](int u, int v) {
      const double r = std::hypot(u - 160, v - 120);
      return -depth * std::clamp((105 - r) / 8, 0.0, 1.0) - 8 * std::max(0.0, 1 - std::abs(r - 85) / 10);
    });
    return leveled(read(truth, [](int) { return 1.0; }), leveler).height(120, 160);
  };
  // The limit is 4 pixels: 0.4 times the depth of the rim after averaging over cells.
  BareGelLeveler bare({kSensor, kPitchMm}, {}, 1, kBorrowedModel),
      pressed({kSensor, kPitchMm}, {}, 1, kBorrowedModel);
  EXPECT_NEAR(fields_height(bare, 3.2), 0, 0.1);
  EXPECT_NEAR(fields_height(bare, 4.7), 0, 0.1);
  EXPECT_NEAR(fields_height(pressed, 8), -8, 0.1);
  EXPECT_NEAR(fields_height(pressed, 4.7), -4.7, 0.1);
  EXPECT_NEAR(fields_height(bare, 8), -8, 0.1) << "what is clearly low is pressed";
}

/// Returns the largest height in pixels that remains after leveling a tilted plane of bare gel.
double left_of_tilt(cv::Size size) {
  cv::Mat1f height = pixel_map<float>({(size.width + 1) / 2, (size.height + 1) / 2},  // of squares
                                      [](int u, int v) { return 0.005 * (u - v); });
  const cv::Mat1b unchanged(size, static_cast<unsigned char>(0));
  BareGelLeveler({size, kPitchMm}, {}, 1, kBorrowedModel)
      .level(height, in_blocks(unchanged), PoissonSolver(size));
  return cv::norm(height(cv::Rect(4, 4, height.cols - 8, height.rows - 8)), cv::NORM_INF);
}

TEST(BareGel, ATiltIsTakenOffAsWellWhereCellsDoNotFillThePicture) {
  EXPECT_LT(left_of_tilt({160, 120}), 0.08);  // of 0.4
  EXPECT_LT(left_of_tilt({162, 121}), left_of_tilt({160, 120}));
  EXPECT_LT(left_of_tilt({121, 162}), left_of_tilt({160, 120}));
}

}  // namespace
}  // namespace gelslam::test
