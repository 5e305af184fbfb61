#pragma once

#include <cmath>
#include <cstddef>
#include <functional>
#include <string>
#include <vector>

#include "gelslam/calibration/press_set.hpp"

namespace gelslam {

/// The part of a press where the gel surely lies on the ball.
struct BallZone {
  std::size_t press = 0;  ///< index into the set
  double u_px = 0.0, v_px = 0.0, radius_px = 0.0;
};

/// Calls visit(u, v) for every pixel inside the zone that shows the gel, row by row.
template <class Visit>
void for_each_pixel(const BallZone& zone, const CalibrationPress& press, const Visit& visit) {
  const cv::Point first(static_cast<int>(std::floor(zone.u_px - zone.radius_px)),
                        static_cast<int>(std::floor(zone.v_px - zone.radius_px)));
  const int side = static_cast<int>(std::ceil(2.0 * zone.radius_px)) + 2;
  const cv::Rect box = cv::Rect(first, cv::Size(side, side)) & cv::Rect({}, press.bgr.size());
  for (int v = box.y; v < box.y + box.height; ++v)
    for (int u = box.x; u < box.x + box.width; ++u)
      if (std::hypot(u - zone.u_px, v - zone.v_px) <= zone.radius_px && press.shows_gel(u, v)) visit(u, v);
}

struct RejectedPress {
  std::size_t press = 0;
  std::string reason;  ///< for people
};

struct BallZones {
  std::vector<BallZone> zones;          ///< in the set's order
  std::vector<RejectedPress> rejected;  ///< presses that cannot be used, and why
};

/// Finds the zones of all presses. A label's center is kept; at which share of its radius the gel leaves
/// the ball is read from the pictures, for the whole set at once (own): people draw the visible edge, 4
/// pixels too wide; circles from geometry (where the ball would cut the undeformed gel) are a third too wide,
/// and what lies between is membrane rim that must not be trained on as if it were the ball. Presses without
/// a label get the circle found when `automatic`; else they are rejected. Presses in another light than the
/// background's are rejected, and so are presses whose colors are not those of the same slopes in the others
/// (find_odd_zones).
/// `progress`, if given, is called with the number of presses done. Throws as require_unmoved_background().
BallZones find_ball_zones(const PressSet& set, double pixel_pitch_mm, bool automatic,
                          const std::function<void(std::size_t)>& progress = nullptr);

/// Throws Error when the gel lies elsewhere in the presses than in the background: the camera has moved
/// between them. Its texture is compared by phase correlation (Kuglin & Hines 1975); a gel without any
/// passes.
void require_unmoved_background(const PressSet& set);

/// Throws Error, which says what to do, when the zones are not enough for a calibration: too few presses, or
/// a side of the gel without any.
void require_good_coverage(const PressSet& set, const BallZones& zones);

/// Zones whose colors are not those that the same slopes have at the same places in the other presses (own):
/// their residual to a smooth model of the gel's colors is three times the median one. The worst is taken
/// out, the model fitted again, and so on; never more than a quarter. Indices in growing order.
std::vector<std::size_t> find_odd_zones(const PressSet& set, const std::vector<BallZone>& zones,
                                        double pixel_pitch_mm);

/// Two balls of different size in one set, compared by their colors.
struct BallSizeComparison {
  double diameter_mm = 0.0, other_diameter_mm = 0.0;
  /// How much steeper the other ball really is than its diameter says, if the first one's is right: 1 when
  /// both are, the said over the true diameter when only the other one's is wrong.
  double steepness = 1.0;
};

/// Compares each size with the smallest (own): the same slope at the same place has the same color, whatever
/// ball makes it. A smooth model of the gel's colors is fitted to one ball's presses, and the factor on the
/// other's slopes is sought that explains its colors best; both ways. No model is needed, so that it works
/// before training: a network can learn each press by its place and be consistent with a wrong diameter.
/// Sizes with fewer than five zones are left out.
std::vector<BallSizeComparison> compare_ball_sizes(const PressSet& set, const std::vector<BallZone>& zones,
                                                   double pixel_pitch_mm);

/// A sentence about two sizes that contradict each other, or "".
std::string contradiction_between_sizes(const std::vector<BallSizeComparison>& comparisons);

}  // namespace gelslam
