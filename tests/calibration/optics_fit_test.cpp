// Optics found from dots and from motion, against what pictures and surfaces were made with; and balls.

#include "gelslam/calibration/optics_fit.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <opencv2/imgproc.hpp>

#include "../support/analytic_surface.hpp"
#include "gelslam/calibration/ball_zones.hpp"
#include "gelslam/core/error.hpp"

namespace gelslam::test {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

const cv::Size kPicture(320, 240);
const SensorOptics kTrue = {0.05, {4, -3}, 1.015, 19, {0.0014, 0.0031}},
                   kStart = {0.037, {0, 0}, 1, 22, {0.0017, 0.0028}};

CameraModel camera_with(const SensorOptics& optics) { return {kPicture, kPitchMm, optics}; }

std::array<double, OpticsFit::kNumbers> numbers_of(const SensorOptics& o) {
  return {o.lens_k1,           o.lens_center_px[0],  o.lens_center_px[1],
          o.pixel_aspect,      o.camera_distance_mm, o.gel_dome_per_mm[0],
          o.gel_dome_per_mm[1]};
}

void expect_honest(const OpticsFit& fit, const SensorOptics& truth) {
  constexpr double kSigmas = 3.5;
  for (std::size_t k = 0; k < OpticsFit::kNumbers; ++k) {
    if (!fit.shown[k]) continue;
    EXPECT_LT(std::abs(numbers_of(fit.optics)[k] - numbers_of(truth)[k]), kSigmas * fit.sigma[k])
        << k << "\n"
        << fit.words();
  }
}

TEST(SeenBall, HasTheSlopesOfACircleWhereNothingIsBent) {
  const BallZone zone{0, 120, 90, 25};
  const CameraModel camera = camera_with({});
  const SeenBall ball(camera, zone, 6.3);
  const double ball_px = 3.15 / kPitchMm;
  const auto slope = ball.slope(camera.to_mm(Vector2d(132, 83)));
  const double down = std::sqrt(ball_px * ball_px - 12 * 12 - 7 * 7);
  EXPECT_NEAR(slope[0], 12 / down, 1e-9);
  EXPECT_NEAR(slope[1], -7 / down, 1e-9);
  EXPECT_TRUE(ball.is_in_zone(camera.to_mm(Vector2d(144.9, 90))));
  EXPECT_FALSE(ball.is_in_zone(camera.to_mm(Vector2d(145.1, 90))));
}

TEST(SeenBall, IsOneSurfaceThatItsRaysMeet) {
  // grad w = g / (1 - g·X / D) has no curl: the slopes are those of some surface; and of a ball: the unit
  // normals of points a known way apart turn by that way over the radius.
  const CameraModel camera = camera_with(kTrue);
  const SeenBall ball(camera, {0, 265, 190, 28}, 6.3);
  const auto absolute = [&](const Vector2d& rest_mm) -> Vector2d {
    const auto relative = ball.slope(rest_mm);
    return Vector2d(relative[0], relative[1]) + camera.rest_slope(camera.rest_point_mm(rest_mm).head<2>());
  };
  const auto derivative_of_w = [&](const Vector2d& rest_mm) -> Vector2d {
    const Vector2d slope = absolute(rest_mm);
    return slope / (1 - slope.dot(rest_mm) / kTrue.camera_distance_mm);
  };
  constexpr double kStep = 1e-4;
  for (const Vector2d& px : {Vector2d(265, 190), Vector2d(255, 200), Vector2d(280, 185)}) {
    const Vector2d at = camera.to_mm(camera.rectified_px(px));
    EXPECT_TRUE(ball.is_in_zone(at));
    const Vector2d x(kStep, 0), y(0, kStep);
    const double curl = (derivative_of_w(at + x).y() - derivative_of_w(at - x).y()) -
                        (derivative_of_w(at + y).x() - derivative_of_w(at - y).x());
    EXPECT_NEAR(curl / (2 * kStep), 0, 1e-6);
  }
}

/// What a sensor with kTrue makes of a touch if it takes its optics for kStart.
SeenFrame misread(const Field& field, const Pose& object_T_sensor) {
  const CameraModel truth = camera_with(kTrue), start = camera_with(kStart);
  auto surface = std::make_shared<Surface>();
  surface->pixel_pitch_mm = kPitchMm;
  surface->optics = kStart;
  surface->contact = cv::Mat1b::zeros(kPicture);
  cv::Mat1f relief(kPicture, 0.0F), gx(kPicture, 0.0F), gy(kPicture, 0.0F);
  cv::Mat1b exact(kPicture, static_cast<unsigned char>(0));
  for (int v = 0; v < kPicture.height; ++v)
    for (int u = 0; u < kPicture.width; ++u) {
      const double radius = std::hypot((u - 159.5) / 110, (v - 119.5) / 85);
      const Vector2d rest_mm = truth.to_mm(truth.rectified_px(*start.raw_px(Vector2d(u, v))));
      double z = 0;
      Vector3d normal;
      if (radius > 1.35 || !follow_ray(field, object_T_sensor, rest_mm.x(), rest_mm.y(), -3, z, normal,
                                       kTrue.camera_distance_mm))
        continue;
      const Vector3d gel = truth.rest_point_mm(rest_mm);
      const double blend = 0.5 + 0.5 * std::cos(M_PI * std::clamp((radius - 1) / 0.35, 0.0, 1.0));
      relief(v, u) = static_cast<float>(blend * (truth.relief_mm(z) - truth.relief_mm(gel.z())));
      if (radius > 1) continue;
      const Vector2d slope = -normal.head<2>() / normal.z() - truth.rest_slope(gel.head<2>());
      gx(v, u) = static_cast<float>(slope.x());
      gy(v, u) = static_cast<float>(slope.y());
      exact(v, u) = 255;
      surface->contact(v, u) = radius < 0.95 ? 255 : 0;
    }
  cv::Mat1f beyond_x, beyond_y;
  cv::Sobel(relief, beyond_x, CV_32F, 1, 0, 1, 0.5 / kPitchMm);
  cv::Sobel(relief, beyond_y, CV_32F, 0, 1, 1, 0.5 / kPitchMm);
  beyond_x.copyTo(gx, exact == 0);
  beyond_y.copyTo(gy, exact == 0);
  surface->height_mm.create(kPicture);
  surface->normals.create(kPicture);
  for (int v = 0; v < kPicture.height; ++v)
    for (int u = 0; u < kPicture.width; ++u) {
      const Vector3d gel = start.rest_point_mm(start.to_mm(cv::Point(u, v)));
      const Vector2d slope = start.rest_slope(gel.head<2>());
      surface->height_mm(v, u) =
          static_cast<float>(start.height_mm(start.relief_mm(gel.z()) + static_cast<double>(relief(v, u))));
      surface->normals(v, u) = cv::normalize(
          cv::Vec3f(-gx(v, u) - static_cast<float>(slope.x()), -gy(v, u) - static_cast<float>(slope.y()), 1));
    }
  surface->contact_pixels = cv::countNonZero(surface->contact);
  return {surface, object_T_sensor};
}

std::vector<SeenFrame> slid_over(const Field& field, double reach_mm, int count) {
  std::vector<SeenFrame> frames;
  for (int k = 0; k < count; ++k) {
    const double t = 2 * M_PI * k / count;
    frames.push_back(misread(field, motion(2 * std::sin(3 * t), 2 * std::cos(5 * t), 25 * std::sin(2 * t),
                                           reach_mm * std::sin(4 * t), 0.7 * reach_mm * std::sin(3 * t + 1),
                                           0.5 + 0.15 * std::sin(7 * t))));
  }
  return frames;
}

TEST(OpticsFromMotion, FindsAllNumbersWithThePoses) {
  const OpticsFit fit = optics_from_motion(slid_over(textured_plane(7, 0.3), 5, 40));
  EXPECT_NEAR(fit.optics.lens_k1, kTrue.lens_k1, 0.001) << fit.words();
  EXPECT_NEAR(fit.optics.pixel_aspect, kTrue.pixel_aspect, 0.001);
  EXPECT_NEAR(fit.optics.camera_distance_mm, kTrue.camera_distance_mm, 0.3);
  EXPECT_NEAR(fit.optics.gel_dome_per_mm[0], kTrue.gel_dome_per_mm[0], 0.0001);
  EXPECT_NEAR(fit.optics.gel_dome_per_mm[1], kTrue.gel_dome_per_mm[1], 0.0001);
  expect_honest(fit, kTrue);
}

TEST(OpticsFromMotion, SaysWhatLittleMotionDoesNotShow) {
  const OpticsFit fit = optics_from_motion(slid_over(textured_plane(7, 0.3), 0.8, 12));
  EXPECT_NE(fit.not_shown(), "") << fit.words();
  EXPECT_THROW(optics_from_motion(slid_over(textured_plane(7, 0.3), 0.02, 4)), Error);
}

}  // namespace
}  // namespace gelslam::test
