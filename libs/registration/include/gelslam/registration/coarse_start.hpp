#pragma once

#include <vector>

#include "gelslam/core/se3.hpp"
#include "gelslam/surface/surface.hpp"

namespace gelslam {

struct CoarseStartOptions {
  int shrink = 2;                  ///< pixels of the surfaces per pixel that is compared
  double twist_step_rad = 0.12;    ///< 7 degrees: much further off, textures no longer agree
  int twist_steps = 3;             ///< to either side of the expected twist
  double min_shared = 0.3;         ///< of the smaller contact
  double min_similarity = 0.3;     ///< normalized cross-correlation of the two textures
  double least_distance_mm = 1.0;  ///< between two places of the same twist
  int places_per_twist = 4;
  int max_starts = 24;
};

/// Where NormalFlow may start (target_T_reference) when the motion was too large for it to follow: shifts and
/// twists about that of `expected` at which the two textures agree, whatever the distance, most alike first,
/// with the tilt that their normals have there. Of a pattern that repeats itself they are many; which of them
/// is the place, relocalization.hpp asks. Empty when the textures are too faint. Source: own.
std::vector<Pose> coarse_starts(const Surface& reference, const Surface& target, const Pose& expected,
                                const CoarseStartOptions& options = {});

}  // namespace gelslam
