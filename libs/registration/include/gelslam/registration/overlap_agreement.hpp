#pragma once

#include "gelslam/core/se3.hpp"
#include "gelslam/surface/surface.hpp"

namespace gelslam {

/// What two surfaces say about the contact they share, once registered.
struct OverlapAgreement {
  int shared_pixels = 0;  ///< of the newer surface, every second one in both directions
  double texture_correlation =
      0;                      ///< of curvature with its mean removed, -1..1: a ball's constant curvature,
                              ///< which any pose on a ball satisfies, does not count as texture
  double height_rmse_mm = 0;  ///< after the mean difference is taken off: how deep a touch was proves nothing
  /// Of what either touched and the other looked at, the share that would have to lie inside the other's bare
  /// gel, by 0.15 mm or more: had the object been there, it would have been felt.
  double free_space_violation = 0;
};

OverlapAgreement compare_overlap(const Surface& older, const Surface& newer, const Pose& older_T_newer);

}  // namespace gelslam
