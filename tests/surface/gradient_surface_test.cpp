#include <gtest/gtest.h>

#include <cmath>
#include <opencv2/core.hpp>

#include "../support/analytic_surface.hpp"
#include "gelslam/surface/slopes.hpp"

namespace gelslam {
namespace {

using test::kPitchMm;

/// A smooth dent in the gel's middle: its height in pixels and its slope.
double dent_px(double x, double y) { return -6.0 * std::exp(-(x * x + y * y) / 800.0); }

TEST(GradientSurfaces, GiveBackADentAndItsContact) {
  const cv::Size size(160, 120);
  cv::Mat1f gx(size), gy(size);
  cv::Mat1b touched(size, static_cast<unsigned char>(0));
  for (int v = 0; v < size.height; ++v)
    for (int u = 0; u < size.width; ++u) {
      const double x = u - 79.5, y = v - 59.5;
      gx(v, u) = static_cast<float>(dent_px(x, y) * -x / 400.0);
      gy(v, u) = static_cast<float>(dent_px(x, y) * -y / 400.0);
      if (std::hypot(x, y) < 20) touched(v, u) = 1;
    }
  const SurfacePtr surface = GradientSurfaces({size, kPitchMm}).make(gx, gy, touched);
  EXPECT_EQ(surface->pixel_pitch_mm, kPitchMm);
  // The corners are 0 in truth; the median over the untouched gel has some of the dent's foot in it.
  EXPECT_NEAR(surface->height_mm(2, 2), 0, 0.1 * kPitchMm);
  EXPECT_NEAR(surface->height_mm(59, 79) - surface->height_mm(2, 2), kPitchMm * dent_px(0.5, 0.5),
              0.01 * 6 * kPitchMm);
  const cv::Vec3f n = surface->normals(59, 99);
  EXPECT_NEAR(-n[0] / n[2], gx(59, 99), 1e-6);
  EXPECT_NEAR(-n[1] / n[2], gy(59, 99), 1e-6);
  EXPECT_NEAR(surface->curvature(59, 79), -2 * dent_px(0, 0) / 400.0, 0.001);
  EXPECT_EQ(surface->curvature(59, 119), 0);
  EXPECT_EQ(surface->contact(59, 97), 255);
  EXPECT_EQ(surface->contact(59, 98), 0) << "eroded by 120/48 = 2 pixels";
  EXPECT_EQ(surface->contact_pixels, cv::countNonZero(surface->contact));
}

}  // namespace
}  // namespace gelslam
