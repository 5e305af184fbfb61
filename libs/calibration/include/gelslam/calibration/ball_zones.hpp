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

/// The part of a press where the gel certainly touches the ball: a disk around the center of the contact's
/// rim whose radius is kZoneMarginMm smaller than that of the contact.
struct BallZone {
  std::size_t press = 0;  ///< index into the set
  double u_px = 0.0, v_px = 0.0, radius_px = 0.0;
};
inline constexpr double kZoneMarginMm = 0.1902;  ///< Width of the gel's bend at the rim.

/// A ball in the gel as the camera sees it. The contact is symmetric about the normal of the gel at rest, so
/// that with an oblique view the deepest point appears beside the center of the rim.
class SeenBall {
 public:
  SeenBall(const CameraModel& camera, const BallZone& zone, double diameter_mm);

  /// Returns the slopes dh/dx, dh/dy relative to the gel at rest where the ray of the given rest coordinates
  /// meets the ball; very large values beyond its outline.
  std::array<double, 2> slope(const Eigen::Vector2d& rest_mm) const;
  /// Says whether the ray meets the ball within the zone.
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
  // Relative to the zone's radius; no lens and no camera distorts a circle more.
  constexpr double kReach = 1.5;
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
  std::string reason;  ///< Reason for the user.
};

struct BallZones {
  std::vector<BallZone> zones;          ///< in the set's order
  std::vector<RejectedPress> rejected;  ///< Presses that cannot be used, with the reason.
  /// Sentence for the user if all labels are displaced from the contacts in the images; or "".
  std::string warning;
};

/// Finds the zones of all presses. The center of a label is kept. The fraction of its radius at which the gel
/// leaves the ball is estimated from the images, once for the whole set (not in the paper), because labels
/// follow different conventions: people draw the visible edge, about 4 pixels too wide, and circles from
/// geometry (where the ball would cut the undeformed gel) are a third too wide. The difference is the rim of
/// the membrane, which must not be trained as if it were the ball. A press without a label gets the
/// automatically found circle if `automatic` is true, else it is rejected. Presses whose light differs from
/// that of the background are rejected. `progress`, if given, is called with the number of presses done.
/// Throws Error for diameters that are too small for the contacts, as when radii were given.
BallZones find_ball_zones(const PressSet& set, double pixel_pitch_mm, bool automatic,
                          const std::function<void(std::size_t)>& progress = nullptr);

/// Throws Error, with advice, when the zones do not suffice for a calibration: too few presses, or a side of
/// the gel without any.
void require_good_coverage(const PressSet& set, const BallZones& zones);

}  // namespace gelslam
