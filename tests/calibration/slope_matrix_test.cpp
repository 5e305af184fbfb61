#include "gelslam/calibration/slope_matrix.hpp"

#include <gtest/gtest.h>

#include <Eigen/LU>
#include <cmath>
#include <random>

#include "gelslam/core/error.hpp"
#include "gelslam/sensor/sensor_profile.hpp"

namespace gelslam::test {
namespace {

using Eigen::Matrix2d;
using Eigen::Vector2d;

/// A ball pressed in, read through a model that reads `scale` times the slopes relative to the gel at rest,
/// and noise.
SurfacePtr pressed_ball(const Vector2d& center_mm, double radius_mm, const Matrix2d& scale, unsigned seed) {
  auto surface = std::make_shared<Surface>();
  surface->optics = kGelSightMiniOptics;
  const cv::Size size(320, 240);
  surface->contact = cv::Mat1b::zeros(size);
  surface->height_mm = cv::Mat1f::zeros(size);
  surface->normals = cv::Mat3f(size, cv::Vec3f(0, 0, 1));
  const CameraModel camera{size, surface->pixel_pitch_mm, surface->optics};
  std::mt19937 generator(seed);
  std::normal_distribution<double> noise(0, 0.1);
  constexpr double kContactMm = 2.2;
  const double bottom_mm = -std::sqrt(radius_mm * radius_mm - kContactMm * kContactMm);
  for (int v = 0; v < size.height; ++v)
    for (int u = 0; u < size.width; ++u) {
      const Vector2d rest_mm = camera.to_mm(cv::Point(u, v));
      double height_mm = 0;
      Vector2d place_mm = rest_mm;
      for (int step = 0; step < 10; ++step) {  // to where the ray meets the ball
        const double depth2 = radius_mm * radius_mm - (place_mm - center_mm).squaredNorm();
        height_mm = depth2 > 0 ? -std::sqrt(depth2) - bottom_mm : 0;
        place_mm = rest_mm * (1 + height_mm * camera.optics.inverse_distance());
      }
      const Vector2d out = place_mm - center_mm;
      if (out.norm() > kContactMm) continue;
      const Vector2d rest = camera.rest_slope(place_mm);
      const Vector2d slope = out / std::sqrt(radius_mm * radius_mm - out.squaredNorm()) - rest;
      const Vector2d read = scale * slope + rest + Vector2d(noise(generator), noise(generator));
      surface->contact(v, u) = 255;
      surface->height_mm(v, u) = static_cast<float>(height_mm);
      const Eigen::Vector3f normal = Eigen::Vector3d(-read.x(), -read.y(), 1).normalized().cast<float>();
      surface->normals(v, u) = {normal.x(), normal.y(), normal.z()};
    }
  surface->contact_pixels = cv::countNonZero(surface->contact);
  return surface;
}

TEST(SlopeMatrix, IsThatWithWhichBallsWereRead) {
  Matrix2d scale;
  scale << 0.8, 0.05, -0.2, 0.65;
  std::vector<SurfacePtr> touches;
  for (unsigned k = 0; k < 9; ++k)
    touches.push_back(pressed_ball({5.0 * (k % 3) - 5, 3.0 * (k / 3) - 3}, 3, scale, k));
  const SlopeMatrix found = slope_matrix_from_ball(touches, 6);
  EXPECT_EQ(found.touches, 9U);
  // A slope's noise of 0.1 on 3000 pixels of slopes of 0.3: 0.006 for a press.
  EXPECT_LT((found.read_over_true - scale).cwiseAbs().maxCoeff(), 0.01) << found.read_over_true;
  EXPECT_TRUE(found.needs_correction());
  // The same presses of a ball half as large again are read as slopes half as steep again.
  EXPECT_NEAR(slope_matrix_from_ball(touches, 9).read_over_true(0, 0) / scale(0, 0), 1.5, 0.15);
}

TEST(SlopeMatrix, LeavesATrueModelAlone) {
  std::vector<SurfacePtr> touches;
  for (unsigned k = 0; k < 4; ++k)
    touches.push_back(pressed_ball({4.0 * k - 6, 1}, 3, Matrix2d::Identity(), k));
  EXPECT_FALSE(slope_matrix_from_ball(touches, 6).needs_correction());
  EXPECT_FALSE(slope_matrix_from_ball({touches[0]}, 6).needs_correction());
}

TEST(SlopeMatrix, RefusesWhatIsNoBall) {
  auto flat = std::make_shared<Surface>(*pressed_ball({0, 0}, 3, Matrix2d::Identity(), 0));
  flat->normals = cv::Mat3f(flat->contact.size(), cv::Vec3f(0.1F, 0, 0.995F));
  EXPECT_THROW(slope_matrix_from_ball({flat}, 6), Error);
  EXPECT_THROW(slope_matrix_from_ball({}, 6), Error);
}

}  // namespace
}  // namespace gelslam::test
