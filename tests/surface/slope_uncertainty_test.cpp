#include <gtest/gtest.h>

#include <cmath>

#include "gelslam/surface/slopes.hpp"

namespace gelslam {
namespace {

// Networks hardly read slopes beyond 31 degrees (docs/benchmarks/slopes.png): they tell little, but more than
// what was filled in.
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
  EXPECT_NEAR(confidence(0, 29), 90, 20);
  for (int degrees = 26; degrees < 31; ++degrees)
    EXPECT_LT(confidence(0, degrees), confidence(0, degrees - 1));
  for (int degrees = 32; degrees < 90; ++degrees) EXPECT_NEAR(confidence(0, degrees), 30, 1);

  cv::Mat1b filled_in(normals.size(), 1);
  doubt_steep_slopes(normals, filled_in);
  EXPECT_EQ(cv::countNonZero(filled_in != 1), 0);
}

}  // namespace
}  // namespace gelslam
