#include "gelslam/surface/slopes.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <opencv2/core.hpp>

#include "../support/analytic_surface.hpp"
#include "../support/pixel_map.hpp"

namespace gelslam {
namespace {

using test::kPitchMm;

/// Returns the height in pixels of a smooth dent in the middle of the gel.
double dent_px(double x, double y) { return -6.0 * std::exp(-(x * x + y * y) / 800.0); }

TEST(GradientSurfaces, GiveBackADentAndItsContact) {
  const cv::Size size(160, 120);
  const auto map = [&](const auto& value) {
    return test::pixel_map<float>(size, [&](int u, int v) { return value(u - 79.5, v - 59.5); });
  };
  const cv::Mat1f gx = map([](double x, double y) { return dent_px(x, y) * -x / 400; }),
                  gy = map([](double x, double y) { return dent_px(x, y) * -y / 400; });
  const cv::Mat1b touched(map([](double x, double y) { return std::hypot(x, y); }) < 20);
  const SurfacePtr surface = GradientSurfaces({size, kPitchMm}).make(gx, gy, touched);
  EXPECT_EQ(surface->pixel_pitch_mm, kPitchMm);
  // The true height of the corners is 0. The level is a little off, because the dent reaches into the gel
  // that is taken for bare.
  EXPECT_NEAR(surface->height_mm(2, 2), 0, 0.1 * kPitchMm);
  EXPECT_NEAR(surface->height_mm(59, 79) - surface->height_mm(2, 2), kPitchMm * dent_px(0.5, 0.5),
              0.01 * 6 * kPitchMm);
  const cv::Vec3f n = surface->normals(59, 99);
  EXPECT_NEAR(-n[0] / n[2], gx(59, 99), 1e-6);
  EXPECT_NEAR(-n[1] / n[2], gy(59, 99), 1e-6);
  EXPECT_NEAR(surface->curvature(59, 79), -2 * dent_px(0, 0) / 400.0, 0.001);
  EXPECT_EQ(surface->curvature(59, 119), 0);
  EXPECT_EQ(surface->contact(59, 93), 255);
  EXPECT_EQ(surface->contact(59, 94), 0) << "eroded by 0.3 mm = 5 pixels";
  EXPECT_EQ(surface->contact_pixels, cv::countNonZero(surface->contact));
}

// Networks hardly read slopes beyond 31 degrees (docs/benchmarks/slopes.png). The confidence there is small,
// but larger than that of interpolated pixels.
TEST(SlopeUncertainty, IsTheLargerTheSteeperBeyondWhatNetworksFollow) {
  const auto normals = test::pixel_map<cv::Vec3f>({90, 1}, [](int degrees, int) {
    return cv::Vec3d(std::sin(degrees * CV_PI / 180), 0, std::cos(degrees * CV_PI / 180));
  });
  cv::Mat1b confidence(normals.size(), 200);
  lower_steep_confidence(normals, confidence);
  EXPECT_EQ(confidence(0, 24), 200);
  EXPECT_NEAR(confidence(0, 29), 90, 20);
  for (int degrees = 26; degrees < 31; ++degrees)
    EXPECT_LT(confidence(0, degrees), confidence(0, degrees - 1));
  for (int degrees = 32; degrees < 90; ++degrees) EXPECT_NEAR(confidence(0, degrees), 30, 1);

  cv::Mat1b filled_in(normals.size(), 1);
  lower_steep_confidence(normals, filled_in);
  EXPECT_EQ(cv::countNonZero(filled_in != 1), 0);
}

}  // namespace
}  // namespace gelslam
