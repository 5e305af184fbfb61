#pragma once

#include <vector>

#include "gelslam/registration/verification.hpp"

namespace gelslam {

/// Proposes where NormalFlow may start (target_T_reference) when the motion was too large for it to follow:
/// shifts and twists about that of `expected` at which the two textures agree, at any distance, the best
/// first, six at most, with the tilt that the normals have there. Empty when the textures are too faint, or
/// differ in size or pitch. Source: own.
std::vector<Pose> coarse_starts(const Surface& reference, const Surface& target, const Pose& expected,
                                const VerificationOptions& options = {});

/// Returns target_T_reference for a twist and a shift in the plane z = 0 (mm) at which two pictures agree:
/// with the tilt at which the normals that meet there agree best, and the shift that brings the points that
/// meet there together. Without tilt and shift along z where no contacts meet. Source: own.
Pose coarse_pose(const Surface& reference, const Surface& target, double twist_rad,
                 const Eigen::Vector2d& shift_mm);

/// Finds the one place where the target fits on the reference, among all shifts and among twists about that
/// of `expected` (target_T_reference), after a registration from there has `failed`. Every place has to pass
/// verify_registered(), and at one that was not expected all motions but z must be observable. Status
/// `ambiguous`: several places fit, as on a pattern that repeats itself. `failed`, as it is: there is no
/// place. Poses come from NormalFlow. Costs up to six registrations. Source: own.
RegistrationResult relocalize(const NormalFlowReference& reference, const Surface& target,
                              const Pose& expected, const RegistrationResult& failed,
                              const NormalFlowOptions& normal_flow, const VerificationOptions& options);

}  // namespace gelslam
