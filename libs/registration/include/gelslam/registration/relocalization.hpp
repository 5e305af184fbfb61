#pragma once

#include <limits>

#include "gelslam/registration/normal_flow.hpp"

namespace gelslam {

struct RelocalizationOptions {
  /// Another place proves nothing when its normals fit this much worse than the best's. Measured: a tooth,
  /// bead or dimple further 1.02 to 1.4 times, on texture that does not repeat 2 to 3 times.
  double rival_residual = 1.15;
  /// Nor does one that lies so many times as far from where it was expected: few hands jump.
  double rival_distance = std::numeric_limits<double>::infinity();
  double least_rival_shared = 0.15;  ///< of the reference's samples: less agrees anywhere
  double least_rival_texture = 0.5;  ///< correlation of curvatures; less is no agreement
  double far_texture = 0.85;         ///< a place that nobody expected has to agree this well
  double far_mm = 1.0;               ///< from here on, along any axis, nobody expected it
  double far_rad = 0.17;
  double max_height_rmse_mm = 0.1;
  double max_free_space_violation = 0.1;  ///< OverlapAgreement::free_space_violation
  double other_place_mm = 0.5;  ///< what makes two places different, along an axis that is observable
  double other_place_rad = 0.07;
};

/// How far a frame was found from where it was expected (target_T_reference): how far its shared center
/// moved, or, if that is more, by how much it turned, 10 degrees to the millimetre, as a hand changes its
/// mind about either.
double innovation_mm(const RegistrationResult& found, const Pose& expected);

/// Where, of all shifts and of twists about that of `expected` (target_T_reference), the target fits on the
/// reference. `found`: what a registration from the expected place found, ok or not; it wins when no other
/// place fits as well. Status `ambiguous` when several places do: a step of one tooth, bead or dimple more.
/// Not ok (that of `found`) when there is no place. Poses come from NormalFlow. Costs some tens of
/// registrations. Source: own.
RegistrationResult relocalize(const NormalFlowReference& reference, const Surface& target,
                              const Pose& expected, const RegistrationResult& found,
                              const NormalFlowOptions& normal_flow,
                              const RelocalizationOptions& options = {});

}  // namespace gelslam
