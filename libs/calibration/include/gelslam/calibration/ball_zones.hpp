#pragma once

#include <Eigen/Core>
#include <array>
#include <cmath>
#include <cstddef>
#include <functional>
#include <string>
#include <vector>

#include "gelslam/calibration/press_set.hpp"
#include "gelslam/surface/camera_model.hpp"

namespace gelslam {

/// The part of a press where the gel surely lies on the ball: about the middle of the contact's rim, this
/// much inside it.
struct BallZone {
  std::size_t press = 0;  ///< index into the set
  double u_px = 0.0, v_px = 0.0, radius_px = 0.0;
};
inline constexpr double kZoneMarginMm = 0.1902;  ///< the width of the gel's bend at the rim

/// A ball in the gel, as the camera sees it: its contact lies symmetrically to the normal of the gel at rest,
/// so that its deepest point appears aside of the middle of its rim.
class SeenBall {
 public:
  SeenBall(const CameraModel& camera, const BallZone& zone, double diameter_mm);

  /// Slopes dh/dx, dh/dy relative to the gel at rest where the ray of rest coordinates meets the ball; very
  /// steep beyond its outline.
  std::array<double, 2> slope(const Eigen::Vector2d& rest_mm) const;
  /// Whether it meets it within the zone.
  bool is_in_zone(const Eigen::Vector2d& rest_mm) const;

  const CameraModel& camera() const { return camera_; }
  const BallZone& zone() const { return zone_; }

 private:
  Eigen::Vector3d from_center_mm(const Eigen::Vector2d& rest_mm) const;

  CameraModel camera_;
  BallZone zone_;
  double radius_mm_, zone_mm_;
  Eigen::Vector3d axis_, center_mm_;
};

/// Calls visit(u, v, rest_mm) for every pixel inside the zone that shows the gel, row by row.
template <class Visit>
void for_each_pixel(const SeenBall& ball, const CalibrationPress& press, const Visit& visit) {
  constexpr double kReach = 1.5;  // of the radius: no lens and no camera bends a circle more
  const BallZone& zone = ball.zone();
  const double reach = kReach * zone.radius_px;
  const cv::Point first(static_cast<int>(std::floor(zone.u_px - reach)),
                        static_cast<int>(std::floor(zone.v_px - reach)));
  const int side = static_cast<int>(std::ceil(2.0 * reach)) + 2;
  const cv::Rect box = cv::Rect(first, cv::Size(side, side)) & cv::Rect({}, press.bgr.size());
  for (int v = box.y; v < box.y + box.height; ++v)
    for (int u = box.x; u < box.x + box.width; ++u) {
      if (!press.shows_gel(u, v)) continue;
      const Eigen::Vector2d rest_mm = ball.camera().to_mm(ball.camera().rectified_px(Eigen::Vector2d(u, v)));
      if (ball.is_in_zone(rest_mm)) visit(u, v, rest_mm);
    }
}

struct RejectedPress {
  std::size_t press = 0;
  std::string reason;  ///< for people
};

struct BallZones {
  std::vector<BallZone> zones;          ///< in the set's order
  std::vector<RejectedPress> rejected;  ///< presses that cannot be used, and why
  std::string warning;                  ///< for people: all labels lie aside of what the pictures show; or ""
};

/// Finds the zones of all presses. A label's center is kept; at which share of its radius the gel leaves
/// the ball is read from the pictures, for the whole set at once (own): people draw the visible edge, 4
/// pixels too wide; circles from geometry (where the ball would cut the undeformed gel) are a third too wide,
/// and what lies between is membrane rim that must not be trained on as if it were the ball. Presses without
/// a label get the circle found when `automatic`; else they are rejected. Presses in another light than the
/// background's are rejected.
/// `progress`, if given, is called with the number of presses done. Throws Error for diameters that are too
/// small for the contacts (own), such as radii.
BallZones find_ball_zones(const PressSet& set, double pixel_pitch_mm, bool automatic,
                          const std::function<void(std::size_t)>& progress = nullptr);

/// Throws Error, which says what to do, when the zones are not enough for a calibration: too few presses, or
/// a side of the gel without any.
void require_good_coverage(const PressSet& set, const BallZones& zones);

}  // namespace gelslam
