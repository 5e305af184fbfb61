#pragma once

#include <array>
#include <cstddef>
#include <opencv2/core/mat.hpp>
#include <string>
#include <vector>

#include "gelslam/calibration/press_set.hpp"

namespace gelslam {

inline constexpr int kMinPresses = 10;  ///< that a calibration needs

/// Where on the gel presses lie, and where they are still missing: nine zones, row by row from the upper
/// left.
class PressCoverage {
 public:
  static constexpr int kSide = 3;

  /// `wanted` presses in all, at least kMinPresses; each zone wants a ninth of them (rounded down), the rest
  /// may lie anywhere.
  PressCoverage(const cv::Size& picture, int wanted);

  void add(const ContactCircle& circle);

  int total() const;
  int wanted() const { return wanted_; }
  int taken(std::size_t zone) const { return taken_[zone]; }
  int missing(std::size_t zone) const;  ///< presses that the zone still wants
  bool enough() const;                  ///< as many as wanted, and no zone wants more
  /// The next thing to do, for people: "press at the upper left (2 more there)", "press anywhere (3 more)",
  /// or, when it is enough, "enough presses, all over the gel".
  std::string advice() const;
  /// Zones that want more, for people: "upper left (2), middle (1)"; "" when none does.
  std::string gaps() const;

 private:
  std::size_t zone_of(const ContactCircle& circle) const;

  cv::Size picture_;
  int wanted_;
  std::array<int, kSide * kSide> taken_{};
};

/// Names of the zones, in their order: "upper left", "top", ...
const char* press_zone_name(std::size_t zone);

/// Slope of a ball of `ball_px` pixels radius at `radius_px` from its middle: the steepest that a zone shows.
double rim_slope(double radius_px, double ball_px);

/// For people: which depths of touch the presses do not cover, by their rim slopes; "" when they are mixed. A
/// model of shallow presses guesses steeper slopes (20 % too flat on a simulated sensor), and one of deep
/// presses reads lighter touches wrong where lamps are near (7 % too flat on one): their gel lies at another
/// height.
std::string missing_depths(const std::vector<double>& rim_slopes);

}  // namespace gelslam
