#pragma once

#include <limits>
#include <vector>

#include "gelslam/registration/verification.hpp"

namespace gelslam {

/// Where NormalFlow may start (target_T_reference) when the motion was too large for it to follow: shifts and
/// twists about that of `expected` at which the two textures agree, at any distance, the best first, six at
/// most, with the tilt that the normals have there. Empty when the textures are too
/// faint, or differ in size or pitch. Source: own.
std::vector<Pose> coarse_starts(const Surface& reference, const Surface& target, const Pose& expected,
                                const VerificationOptions& options = {});

/// Whether all motions are observable but that along z, which comes from the heights. If one is not, the part
/// of the object that the target shows is not known.
bool is_located(const RegistrationResult& registration);

/// How far a frame was found from where it was expected (target_T_reference), in mm: by how much its shared
/// center moved or, if that is more, by how much it turned (kMmPerRad).
double innovation_mm(const RegistrationResult& found, const Pose& expected);

/// Finds the one place where the target fits on the reference, among all shifts and among twists about that
/// of `expected` (target_T_reference). `found` is the result of a registration from the expected place, ok or
/// not; it wins when no other place fits as well. Every place has to pass verify_registered(), and one that
/// was not expected, is_located(). Status `ambiguous`: several places fit, as on a pattern that repeats
/// itself; places more than `rival_distance` times as far from the expected one as the best do not count. Not
/// ok (that of `found`): there is no place. Poses come from NormalFlow. Costs up to six registrations.
/// Source: own.
RegistrationResult relocalize(const NormalFlowReference& reference, const Surface& target,
                              const Pose& expected, const RegistrationResult& found,
                              const NormalFlowOptions& normal_flow, const VerificationOptions& options,
                              double rival_distance = std::numeric_limits<double>::infinity());

}  // namespace gelslam
