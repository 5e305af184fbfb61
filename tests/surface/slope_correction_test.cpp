#include "gelslam/surface/slope_correction.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <opencv2/core.hpp>

namespace gelslam {
namespace {

constexpr int kWidth = 160, kHeight = 120;

SlopeCorrection of_scale(const GradientScale& read_over_true) {
  SlopeCorrection correction;
  correction.factors[0] = 1.0 - 1.0 / read_over_true.x;
  correction.factors[3] = 1.0 - 1.0 / read_over_true.y;
  return correction;
}

/// A dent of the gel, 1.2 mm wide and 0.6 mm deep, with slopes read `gain` times too steep and heights
/// integrated from them; touched where it is deep.
Surface dent(double gain_x, double gain_y) {
  Surface surface;
  surface.pixel_pitch_mm = 0.1;
  const cv::Size size(kWidth, kHeight);
  surface.height_mm = cv::Mat1f(size);
  surface.normals = cv::Mat3f(size);
  surface.contact = cv::Mat1b::zeros(size);
  surface.curvature = cv::Mat1f::zeros(size);
  for (int v = 0; v < kHeight; ++v)
    for (int u = 0; u < kWidth; ++u) {
      const double x = 0.1 * (u - 79.5), y = 0.1 * (v - 59.5),
                   depth = 0.6 * std::exp(-0.5 * (x * x + y * y) / 1.44);
      const double gx = gain_x * depth * x / 1.44, gy = gain_y * depth * y / 1.44;
      const double nz = 1 / std::sqrt(1 + gx * gx + gy * gy);
      surface.normals(v, u) = cv::Vec3d(-gx * nz, -gy * nz, nz);
      surface.height_mm(v, u) = static_cast<float>(-gain_x * depth);
      if (depth > 0.2) surface.contact(v, u) = 255;
    }
  return surface;
}

TEST(SlopeCorrection, NoneLeavesTheSurfaceAsItIs) {
  const Surface read = dent(1.0, 1.0);
  const SurfacePtr same = SlopeCorrector().apply(read, {});
  EXPECT_LT(cv::norm(same->normals, read.normals, cv::NORM_INF), 1e-6);
  EXPECT_LT(cv::norm(same->height_mm, read.height_mm, cv::NORM_INF), 1e-6);
}

TEST(SlopeCorrection, TakesAGainFromSlopesAndHeights) {
  const Surface truth = dent(1.0, 1.0);
  const SurfacePtr corrected = SlopeCorrector().apply(dent(1.2, 1.2), of_scale({1.2, 1.2}));
  EXPECT_LT(cv::norm(corrected->normals, truth.normals, cv::NORM_INF), 1e-5);
  // The dent's rim is 6 sigma wide and the pixels are 0.1 mm: what the integral of sampled slopes leaves.
  EXPECT_LT(cv::norm(corrected->height_mm, truth.height_mm, cv::NORM_INF), 0.002);
}

TEST(SlopeCorrection, GainsAlongTheAxesDoNotMix) {
  const Surface truth = dent(1.0, 1.0);
  const SurfacePtr corrected = SlopeCorrector().apply(dent(1.1, 0.9), of_scale({1.1, 0.9}));
  EXPECT_LT(cv::norm(corrected->normals, truth.normals, cv::NORM_INF), 1e-5);
}

TEST(SlopeCorrection, BareGelStaysFlatAndAtZeroWhateverTheFactors) {
  const Surface read = dent(1.0, 1.0);
  SlopeCorrection correction;
  correction.factors.setConstant(0.1);
  const SurfacePtr corrected = SlopeCorrector().apply(read, correction);
  const cv::Rect corner(0, 0, 20, 20);  // 9 sigma away
  EXPECT_LT(cv::norm(corrected->normals(corner), read.normals(corner), cv::NORM_INF), 1e-6);
  EXPECT_LT(cv::norm(corrected->height_mm(corner), cv::NORM_INF), 0.02);
  EXPECT_GT(cv::norm(corrected->normals, read.normals, cv::NORM_INF), 0.02);
}

TEST(SlopeCorrection, TakesSurfacesOfAnySizeInTurn) {
  const Surface large = dent(1.1, 0.9);
  Surface small = large;
  const cv::Rect part(20, 10, 101, 93);
  small.height_mm = large.height_mm(part).clone();
  small.normals = large.normals(part).clone();
  small.contact = large.contact(part).clone();
  small.curvature = large.curvature(part).clone();
  const SlopeCorrection correction = of_scale({1.1, 0.9});
  SlopeCorrector corrector;
  for (const Surface* read : {&large, static_cast<const Surface*>(&small)}) {
    const SurfacePtr corrected = corrector.apply(*read, correction),
                     alone = SlopeCorrector().apply(*read, correction);
    ASSERT_EQ(corrected->normals.size(), read->normals.size());
    EXPECT_EQ(cv::norm(corrected->height_mm, alone->height_mm, cv::NORM_INF), 0);
  }
}

}  // namespace
}  // namespace gelslam
