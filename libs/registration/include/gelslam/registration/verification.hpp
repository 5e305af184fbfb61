#pragma once

#include "gelslam/core/uncertain_pose.hpp"
#include "gelslam/registration/normal_flow.hpp"

namespace gelslam {

/// The limits of verify(), by which two surfaces show the same place. They were measured on keyframe pairs of
/// sequences with truth. Ratios and correlations have no unit.
struct VerificationOptions {
  CurvatureLimits curvature;  ///< instead of NormalFlowOptions::curvature; SCR of the smaller contact
  /// The least RegistrationResult::texture_correlation of a loop candidate. Right places have 0.6 (a pen) to
  /// 0.97, wrong ones less than 0.5.
  double min_texture_correlation = 0.6;
  /// The least texture correlation of a place that was only found by searching all shifts, and for one loop
  /// to join two trials. Among many shifts a wrong one agrees more easily: with 0.75 a jump to another part
  /// of an object was taken for a small one.
  double sure_texture_correlation = 0.85;
  /// Self-similarity above which a surface shows no place by itself. A cloth or a thread has 0.95, a knurl
  /// 0.6, other objects less than 0.5. On such a surface the place must be known beforehand, to
  /// kObservableSigmaMm.
  double max_self_similarity = 0.8;
  /// Another place is no rival when its normals fit this many times worse than those of the best. Measured:
  /// one tooth, bead or dimple away they fit 1.02 to 1.4 times worse; on texture that does not repeat, 2 to 3
  /// times.
  double rival_residual = 1.15;
};

/// Says what was known of the relative pose before the two surfaces were compared. The less it was, the
/// better they have to agree.
enum class PlacePrior {
  odometry,        ///< predicted by the motion or by the pose graph, which state its covariance: the
                   ///< registration has to succeed
  loop_candidate,  ///< recognized, or nearby: the textures have to agree, too
  unknown,         ///< the best of all shifts: the textures have to agree clearly
};

/// Decides whether two surfaces show the same place: registers them from there, then applies
/// verify_registered(). The result is ok() if they do, or its status says why not: a surface that repeats
/// itself is `ambiguous`. SCR is that of the smaller contact. The covariance is that of an
/// odometry prior; loop candidates have none.
RegistrationResult verify(const NormalFlowReference& reference, const NormalFlowReference& target,
                          const UncertainPose& target_T_reference, PlacePrior prior,
                          const NormalFlowOptions& registration, const VerificationOptions& options);

/// Applies the tests that follow a successful registration: texture and free space. Returns `registration`
/// with the status of the first test that fails.
RegistrationResult verify_registered(const NormalFlowReference& reference, const Surface& target,
                                     const RegistrationResult& registration, PlacePrior prior,
                                     const VerificationOptions& options);

}  // namespace gelslam
