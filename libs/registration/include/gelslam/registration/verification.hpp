#pragma once

#include "gelslam/core/uncertain_pose.hpp"
#include "gelslam/registration/normal_flow.hpp"

namespace gelslam {

/// The limits of verify(). They were measured on pairs of keyframes of sequences with ground truth. None of
/// them has a unit.
struct VerificationOptions {
  /// The limits of the registration, used instead of NormalFlowOptions::curvature. The SCR is that of the
  /// smaller contact.
  CurvatureLimits curvature;
  /// The smallest RegistrationResult::texture_correlation of a loop candidate. At right places it is 0.6 (on
  /// a pen) to 0.97, at wrong ones less than 0.5.
  double min_texture_correlation = 0.6;
  /// The smallest texture correlation of a pose that was found by a search over all shifts, and of a loop
  /// that joins two trials without the support of another loop. Among many shifts, a wrong one agrees more
  /// easily: with 0.75, frames of another part of the object were accepted at wrong poses nearby.
  double sure_texture_correlation = 0.85;
  /// The largest self_similarity() of a surface whose texture determines the place. It is 0.95 for a cloth or
  /// a thread, 0.6 for a knurl, and less than 0.5 for other objects. If it is exceeded, the pose has to be
  /// known in advance, with a standard deviation of at most kObservableSigmaMm.
  double max_self_similarity = 0.8;
  /// A pose at another place makes a relocalization ambiguous if the residual of its normals is less than
  /// this many times that of the best pose. One tooth, bead or dimple beside the right place it is 1.02 to
  /// 1.4 times as large, and on texture that does not repeat 2 to 3 times.
  double rival_residual = 1.15;
};

/// What was known of the relative pose before the two surfaces were compared. The less was known, the better
/// they have to agree.
enum class PlacePrior {
  odometry,        ///< the pose was predicted by odometry or the pose graph, with a covariance; its texture
                   ///< correlation is not tested
  loop_candidate,  ///< the pose was found by place recognition, or the place is near by; the texture
                   ///< correlation has to reach min_texture_correlation
  unknown,         ///< the pose is the best of a search over all shifts; the texture correlation has to reach
                   ///< sure_texture_correlation
};

/// Decides whether two surfaces show the same place: tests their self-similarity, registers them from the
/// pose target_T_reference, and applies verify_registered(). The result is ok() if they do; otherwise its
/// status says why not. A surface with a repeating texture is `ambiguous`, unless the pose is known well
/// enough. The covariance of the pose is used for odometry priors; candidates of place recognition have none.
RegistrationResult verify(const NormalFlowReference& reference, const NormalFlowReference& target,
                          const UncertainPose& target_T_reference, PlacePrior prior,
                          const NormalFlowOptions& registration, const VerificationOptions& options);

/// Applies the tests that follow a registration: texture correlation and free space. Returns `registration`,
/// with the status of the first test that fails. A registration that has failed is returned unchanged.
RegistrationResult verify_registered(const NormalFlowReference& reference, const Surface& target,
                                     const RegistrationResult& registration, PlacePrior prior,
                                     const VerificationOptions& options);

}  // namespace gelslam
