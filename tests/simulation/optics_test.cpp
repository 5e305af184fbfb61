#include "gelslam/simulation/optics.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <opencv2/core.hpp>

#include "gelslam/core/error.hpp"
#include "gelslam/surface/camera_model.hpp"

namespace gelslam {
namespace {

const SensorGeometry kMini;

GelShape gel_with_slope(float gx, float gy) {
  GelShape gel;
  gel.height_mm = cv::Mat1f(kMini.height_px, kMini.width_px, 0.0F);
  gel.contact = cv::Mat1b(kMini.height_px, kMini.width_px, static_cast<std::uint8_t>(0));
  gel.slope = cv::Mat2f(kMini.height_px, kMini.width_px, cv::Vec2f(gx, gy));
  return gel;
}

OpticsOptions quiet() {
  OpticsOptions options;
  options.noise_gain = 0;
  return options;
}

/// Change of color per unit of slope at the center, BGR.
cv::Vec3d sensitivity(float gx, float gy) {
  const Optics optics(kMini, quiet());
  const cv::Mat3b up = optics.render(gel_with_slope(gx, gy), 0, true),
                  down = optics.render(gel_with_slope(-gx, -gy), 0, true);
  const double twice = 2 * std::hypot(gx, gy);
  return (cv::Vec3d(up(120, 160)) - cv::Vec3d(down(120, 160))) / twice;
}

TEST(Optics, AnswersToSlopesLikeARealSensor) {
  // Fitted to 36 real presses: per unit of slope in x, then in y; half to twice is the same look.
  const cv::Vec3d x = sensitivity(0.2F, 0), y = sensitivity(0, 0.2F);
  EXPECT_NEAR(x[1], 93, 35);    // green from the right
  EXPECT_NEAR(y[2], -110, 35);  // red from the top
  EXPECT_NEAR(y[0], 67, 35);    // blue from below
  EXPECT_LT(std::abs(y[1]), 25);
  EXPECT_LT(std::abs(x[2]), 45);
}

/// How much darker the dotted gel is at each pixel, as a share.
cv::Mat1d ink_on(const GelShape& gel) {
  OpticsOptions dotted = quiet();
  dotted.dot_spacing_mm = 2.0;
  const cv::Mat3b with = Optics(kMini, dotted).render(gel, 0, true),
                  without = Optics(kMini, quiet()).render(gel, 0, true);
  cv::Mat1d ink(with.size());
  for (int v = 0; v < ink.rows; ++v)
    for (int u = 0; u < ink.cols; ++u)
      ink(v, u) = 1.0 - with(v, u)[1] / std::max(1.0, 1.0 * without(v, u)[1]);
  return ink;
}

TEST(Optics, PrintsDotsThatTheGelCarriesAlong) {
  const auto center = [](const cv::Mat1d& ink) {  // of the dot in the middle, half a spacing around it
    double sum = 0, u_sum = 0, v_sum = 0;
    for (int v = 104; v <= 135; ++v)
      for (int u = 144; u <= 175; ++u) {
        sum += ink(v, u);
        u_sum += u * ink(v, u);
        v_sum += v * ink(v, u);
      }
    EXPECT_NEAR(sum * std::pow(kMini.pixel_pitch_mm, 2), 0.7 * std::acos(-1.0) / 9.0, 0.05);
    return cv::Point2d(u_sum / sum, v_sum / sum);
  };
  const cv::Point2d moved =
      center(ink_on(gel_with_slope(0.2F, -0.3F))) - center(ink_on(gel_with_slope(0, 0)));
  EXPECT_NEAR(moved.x * kMini.pixel_pitch_mm, 0.10, 0.01);
  EXPECT_NEAR(moved.y * kMini.pixel_pitch_mm, -0.15, 0.01);
  OpticsOptions dense = quiet();
  dense.dot_spacing_mm = 0.2;
  EXPECT_THROW(Optics(kMini, dense), Error);
}

/// A sensor with all effects, and what its camera sees of a ball deep in the gel, off the middle.
struct RealSensor {
  RealSensor() {
    geometry.optics = {0.045, {6, -4}, 1.03, 22, {0.0017, 0.0028}};
    camera = {{geometry.width_px, geometry.height_px}, geometry.pixel_pitch_mm, geometry.optics};
  }
  /// Where the surface estimation takes the pixel's ray to meet the plane z = 0.
  Eigen::Vector2d plane_mm(int u, int v) const {
    return camera.to_mm(camera.rectified_px({1.0 * u, 1.0 * v}));
  }

  SensorGeometry geometry;
  CameraModel camera;
};

TEST(Optics, PixelsShowTheBallThatTheirRayMeets) {
  const RealSensor sensor;
  const Optics optics(sensor.geometry, quiet());
  const double radius = 4, x = 5, y = -3.5, depth = 1.2;
  const PressedBall pressed = press_ball(optics.gel_grid(), radius, x, y, depth);
  const GelView view = optics.view(pressed.gel);
  const ImageCircle circle = seen_circle(optics, pressed);
  EXPECT_GT(circle.radius_px, 25);
  int inside = 0;
  for (int v = 0; v < 240; ++v)
    for (int u = 0; u < 320; ++u) {
      if (std::hypot(u - circle.center_px.x, v - circle.center_px.y) > circle.radius_px - 4) continue;
      // The first point of the sphere on the line from the camera, solved in closed form.
      const Eigen::Vector2d plane = sensor.plane_mm(u, v);
      const Eigen::Vector3d camera(0, 0, -22), ball(x, y, radius - depth),
          along = Eigen::Vector3d(plane.x(), plane.y(), 22).normalized();
      const double to_middle = (ball - camera).dot(along),
                   half_chord =
                       std::sqrt(radius * radius - ((ball - camera) - to_middle * along).squaredNorm());
      const Eigen::Vector3d normal = camera + (to_middle - half_chord) * along - ball;
      ASSERT_NEAR(view.slope(v, u)[0], -normal.x() / normal.z(), 0.015) << u << " " << v;
      ASSERT_NEAR(view.slope(v, u)[1], -normal.y() / normal.z(), 0.015) << u << " " << v;
      ++inside;
    }
  EXPECT_GT(inside, 1500);
}

TEST(Optics, TheBareGelIsDomedAndDotsLieWhereTheCameraProjectsThem) {
  const RealSensor sensor;
  OpticsOptions dotted = quiet();
  dotted.dot_spacing_mm = 2.0;
  const Optics optics(sensor.geometry, dotted), plain(sensor.geometry, quiet());
  const GelShape rest = gel_at_rest(optics.gel_grid());
  const cv::Mat2f slope = optics.view(rest).slope;
  for (const cv::Point px : {cv::Point(20, 30), cv::Point(300, 120), cv::Point(160, 230)}) {
    const Eigen::Vector3d seen = sensor.camera.rest_point_mm(sensor.plane_mm(px.x, px.y));
    EXPECT_NEAR(slope(px)[0], -2 * 0.0017 * seen.x(), 1e-3);
    EXPECT_NEAR(slope(px)[1], -2 * 0.0028 * seen.y(), 1e-3);
  }
  cv::Mat3f ink;
  cv::subtract(plain.background(), optics.background(), ink);
  for (const Eigen::Vector2d& dot : {Eigen::Vector2d(-8, 4), Eigen::Vector2d(6, -6), Eigen::Vector2d(0, 0)}) {
    // Ink is half a millimeter deep, along the normal of the dome.
    const Eigen::Vector2d place =
        dot.cwiseQuotient(Eigen::Vector2d(1 + 0.5 * 2 * 0.0017, 1 + 0.5 * 2 * 0.0028));
    const Eigen::Vector3d point(place.x(), place.y(), sensor.camera.rest_height_mm(place));
    const Eigen::Vector2d px = *sensor.camera.raw_px(sensor.camera.to_px(sensor.camera.project(point)));
    double sum = 0, u_sum = 0, v_sum = 0;
    for (int v = cvRound(px.y()) - 12; v <= cvRound(px.y()) + 12; ++v)
      for (int u = cvRound(px.x()) - 12; u <= cvRound(px.x()) + 12; ++u) {
        const double share = static_cast<double>(ink(v, u)[1]) / plain.background()(v, u)[1];
        sum += share;
        u_sum += share * u;
        v_sum += share * v;
      }
    EXPECT_NEAR(u_sum / sum, px.x(), 0.1) << dot.transpose();
    EXPECT_NEAR(v_sum / sum, px.y(), 0.1) << dot.transpose();
  }
}

TEST(Optics, NoiseHasTheStatedSizeAndNoMean) {
  const Optics optics(kMini, {});
  const cv::Mat3b a = optics.render(gel_with_slope(0, 0), 1, false),
                  b = optics.render(gel_with_slope(0, 0), 2, false);
  double squares = 0, sum = 0, expected = 0;
  for (int v = 0; v < a.rows; ++v)
    for (int u = 0; u < a.cols; ++u)
      for (int c = 0; c < 3; ++c) {
        const double level = optics.background()(v, u)[c],
                     difference = double(a(v, u)[c]) - double(b(v, u)[c]);
        squares += difference * difference;
        sum += a(v, u)[c] - level;
        expected += 2 * (0.49 + 0.01 * level + 1.0 / 12);  // read, shot, rounding
      }
  EXPECT_NEAR(squares / expected, 1, 0.02);
  EXPECT_NEAR(sum / static_cast<double>(3 * a.total()), 0, 0.01);
}

}  // namespace
}  // namespace gelslam
