#include "pressed_ball.hpp"

#include <algorithm>
#include <cmath>

#include "shape_makers.hpp"

namespace gelslam::simulation::detail {
namespace {

/// Largest distance of a contact pixel from the center: the circle's radius, also where the picture cuts it.
double contact_radius_px(const cv::Mat1b& contact, const cv::Point2d& center) {
  double squared = 0;
  for (int v = 0; v < contact.rows; ++v)
    for (int u = 0; u < contact.cols; ++u)
      if (contact(v, u) != 0)
        squared = std::max(squared, (u - center.x) * (u - center.x) + (v - center.y) * (v - center.y));
  return std::sqrt(squared);
}

}  // namespace

PressedBall press_ball(const SensorGeometry& geometry, const GelOptions& gel, double ball_radius_mm,
                       double x_mm, double y_mm, double depth_mm) {
  Pose sensor_T_ball = Pose::Identity();
  sensor_T_ball.translation() << x_mm, y_mm, ball_radius_mm - depth_mm;
  PressedBall pressed;
  pressed.gel = press_object(*make_ball(static_cast<float>(ball_radius_mm)), sensor_T_ball, geometry, gel);
  pressed.center_px = {x_mm / geometry.pixel_pitch_mm + 0.5 * geometry.width_px - 0.5,
                       y_mm / geometry.pixel_pitch_mm + 0.5 * geometry.height_px - 0.5};
  pressed.radius_px = contact_radius_px(pressed.gel.contact, pressed.center_px);
  return pressed;
}

}  // namespace gelslam::simulation::detail
