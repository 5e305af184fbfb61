#pragma once

#include <vector>

#include "gelslam/registration/verification.hpp"

namespace gelslam {

/// Returns initial poses (target_T_reference) for NormalFlow after a motion that was too large for it to
/// follow. The search covers all shifts, and twists within 0.36 rad of that of `expected`. The result are at
/// most six poses at which the textures of the two surfaces agree, the best first. It is empty if the
/// textures are too faint, or if the pictures differ in size or pixel pitch. coarse_start.cpp describes the
/// method, which is not in the papers.
std::vector<Pose> coarse_starts(const Surface& reference, const Surface& target, const Pose& expected,
                                const VerificationOptions& options = {});

/// Returns the pose target_T_reference for a twist (rad) and a shift in the plane z = 0 (mm) at which two
/// pictures agree. Its tilt minimizes the differences between the normals that then coincide, and its
/// translation makes the centroids of the points that coincide agree. If the contacts do not overlap, tilt
/// and z are 0. This step is not in the papers.
Pose coarse_pose(const Surface& reference, const Surface& target, double twist_rad,
                 const Eigen::Vector2d& shift_mm);

/// Finds the pose of the target on the reference after a registration from the pose `expected`
/// (target_T_reference) has failed. `failed` is the result of that registration, which is returned if no pose
/// is found. The candidates are those of coarse_starts(), registered by NormalFlow, so that the cost is at
/// most six registrations. Each has to pass verify_registered(), and if it is farther than kMinPeriodMm from
/// the expected pose, all its motions except z have to be observable. The status is `ambiguous` if several
/// poses fit, as on a repeating texture. This step is not in the papers.
RegistrationResult relocalize(const NormalFlowReference& reference, const Surface& target,
                              const Pose& expected, const RegistrationResult& failed,
                              const NormalFlowOptions& normal_flow, const VerificationOptions& options);

}  // namespace gelslam
