#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

#include "gelslam/calibration/ball_zones.hpp"
#include "gelslam/calibration/circle_finder.hpp"

namespace gelslam {
namespace {

// The gel's slope falls by a factor e over this length beside a contact (median over real presses), so that
// the rim lies deeper than the gel at rest by its slope times this.
constexpr double kMembraneMm = 0.5;
constexpr double kDeepestRim = 0.98;  // of the ball's radius

}  // namespace

SeenBall::SeenBall(const CameraModel& camera, const BallZone& zone, double diameter_mm)
    : camera_(camera), zone_(zone), radius_mm_(0.5 * diameter_mm) {
  const Eigen::Vector2d raw_px(zone.u_px, zone.v_px), rest_mm = camera.to_mm(camera.rest_px(raw_px));
  const Eigen::Vector3d gel = camera.rest_point_mm(rest_mm);
  const Eigen::Vector2d slope = camera.rest_slope(gel.head<2>());
  axis_ = Eigen::Vector3d(-slope.x(), -slope.y(), 1.0).normalized();
  const auto across_mm = [&](double px, double height_mm) {
    return px * rest_px_per_raw_px(camera, raw_px) * camera.pitch_mm *
           (1.0 + height_mm * camera.optics.inverse_distance());
  };
  const double contact_mm =
      std::min(across_mm(zone.radius_px + kZoneMarginPx, gel.z()), kDeepestRim * radius_mm_);
  const double down_mm = std::sqrt(radius_mm_ * radius_mm_ - contact_mm * contact_mm);
  const double rim_mm = gel.z() - contact_mm / down_mm * kMembraneMm;
  zone_mm_ = across_mm(zone.radius_px, rim_mm);
  center_mm_ = camera.point_mm(rest_mm, rim_mm) + down_mm * axis_;
}

/// To the nearer point of the ball on a ray; to the ray's nearest point where it misses the ball.
Eigen::Vector3d SeenBall::from_center_mm(const Eigen::Vector2d& rest_mm) const {
  const Eigen::Vector2d sideways = camera_.optics.inverse_distance() * rest_mm;
  const Eigen::Vector3d ray(sideways.x(), sideways.y(), 1.0);
  const Eigen::Vector3d start = Eigen::Vector3d(rest_mm.x(), rest_mm.y(), 0.0) - center_mm_;
  const double along = ray.dot(start), squared = ray.squaredNorm();
  const double root = along * along - squared * (start.squaredNorm() - radius_mm_ * radius_mm_);
  return start + ray * ((-along - std::sqrt(std::max(root, 0.0))) / squared);
}

std::array<double, 2> SeenBall::slope(const Eigen::Vector2d& rest_mm) const {
  constexpr double kLeastDown = 1e-5;  // of the radius
  const Eigen::Vector3d point = from_center_mm(rest_mm);
  const Eigen::Vector2d slope = point.head<2>() / std::max(-point.z(), kLeastDown * radius_mm_) -
                                camera_.rest_slope(camera_.rest_point_mm(rest_mm).head<2>());
  return {slope.x(), slope.y()};
}

bool SeenBall::is_in_zone(const Eigen::Vector2d& rest_mm) const {
  const Eigen::Vector3d point = from_center_mm(rest_mm);
  return point.z() < 0 && point.cross(axis_).norm() <= zone_mm_;
}

}  // namespace gelslam
