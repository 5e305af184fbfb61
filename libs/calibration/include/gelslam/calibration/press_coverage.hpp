#pragma once

#include <array>
#include <cstddef>
#include <opencv2/core/mat.hpp>
#include <string>
#include <vector>

#include "gelslam/calibration/press_set.hpp"

namespace gelslam {

inline constexpr int kMinPresses = 10;  ///< Minimum number of presses for a calibration.

/// Counts where on the gel presses were made, and where more are needed, in nine zones, row by row from the
/// upper left.
class PressCoverage {
 public:
  static constexpr int kSide = 3;

  /// `wanted` is the total number of presses, at least kMinPresses. Each zone needs a ninth of them (rounded
  /// down); the rest may be anywhere.
  PressCoverage(const cv::Size& picture, int wanted);

  void add(const ContactCircle& circle);

  int total() const;
  int wanted() const { return wanted_; }
  int taken(std::size_t zone) const { return taken_[zone]; }
  int missing(std::size_t zone) const;  ///< Presses that the zone still needs.
  bool enough() const;                  ///< True if the total is reached and no zone needs more.
  /// Returns the next instruction for the user: "press at the upper left (2 more there)", "press anywhere (3
  /// more)", or "enough presses, all over the gel".
  std::string advice() const;
  /// Returns the zones that need more presses, for the user: "upper left (2), middle (1)"; "" if there are
  /// none.
  std::string gaps() const;

 private:
  std::size_t zone_of(const ContactCircle& circle) const;

  cv::Size picture_;
  int wanted_;
  std::array<int, kSide * kSide> taken_{};
};

/// Returns the name of a zone: "upper left", "top", ...
const char* press_zone_name(std::size_t zone);

/// Returns the slope of a ball with a radius of `ball_px` pixels at the distance `radius_px` from its center,
/// which is the largest slope in a zone of that radius.
double rim_slope(double radius_px, double ball_px);

/// Returns a sentence for the user if the presses cover only shallow or only deep touches, judged by their
/// largest slopes; or "". A model that was trained with shallow presses extrapolates to steeper slopes (20 %
/// too flat on a simulated sensor). One that was trained with deep presses misreads lighter touches if the
/// lamps are near, as the gel is at another height (7 % too flat on one sensor).
std::string missing_depths(const std::vector<double>& rim_slopes);

}  // namespace gelslam
