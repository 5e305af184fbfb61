#include <gtest/gtest.h>

#include <cmath>

#include "gelslam/surface/slopes.hpp"

namespace gelslam {
namespace {

// Networks do not read slopes beyond 32 degrees (docs/benchmarks/slopes.png): they tell next to nothing, but
// still more than what was filled in.
TEST(SlopeUncertainty, IsTheLargerTheSteeperBeyondWhatNetworksFollow) {
  cv::Mat3f normals(1, 90);
  for (int degrees = 0; degrees < normals.cols; ++degrees) {
    const double slope = degrees * CV_PI / 180;
    normals(0, degrees) =
        cv::Vec3f(static_cast<float>(std::sin(slope)), 0, static_cast<float>(std::cos(slope)));
  }
  cv::Mat1b confidence(normals.size(), 200);
  doubt_steep_slopes(normals, confidence);
  EXPECT_EQ(confidence(0, 24), 200);
  EXPECT_NEAR(confidence(0, 29), 100, 20);
  for (int degrees = 26; degrees < 32; ++degrees)
    EXPECT_LT(confidence(0, degrees), confidence(0, degrees - 1));
  for (int degrees = 33; degrees < 90; ++degrees) EXPECT_EQ(confidence(0, degrees), 2);

  cv::Mat1b filled_in(normals.size(), 1);
  doubt_steep_slopes(normals, filled_in);
  EXPECT_EQ(cv::countNonZero(filled_in != 1), 0);
}

}  // namespace
}  // namespace gelslam
