#pragma once

#include <string>
#include <vector>

#include "gelslam/calibration/ball_zones.hpp"

namespace gelslam {

/// Two balls of different size in one set, seen by their colors.
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
