// Finds where a frame lies on a reference after a registration from the expected pose has failed (own).
//
// coarse_starts() proposes up to six poses at which the textures agree. A registration of at most
// kStartIterations steps refines each of them, and verify_registered() judges it as a pose that nothing else
// suggests; farther than kMinPeriodMm from the expected pose, all motions but z must be observable, too. Of
// the candidates that pass, the one with the smallest residual of normals is taken.
//
// The status is `ambiguous` if another pose, farther away than half a period along an observable axis, fits
// nearly as well (VerificationOptions::rival_residual). Without any candidate the failed registration is
// returned. A place beyond the 20 degrees of twist that coarse_starts() searches is not found.

#include "gelslam/registration/relocalization.hpp"

#include <algorithm>
#include <cmath>

namespace gelslam {
namespace {

constexpr int kStartIterations = 15;  // Where a start is right, registration is there in fewer.

/// The difference between two poses of the target, along the target's axes: how the shared center moves, and
/// the turn.
struct Difference {
  Eigen::Vector3d shift_mm, turn_mm;
};

Difference difference(const RegistrationResult& from, const Pose& to) {
  const Pose& pose = from.target_T_reference;
  return {to * from.shared_center_mm - pose * from.shared_center_mm,
          kMmPerRad * so3_log(to.linear() * pose.linear().transpose())};
}

/// Returns the larger of how far the shared center lies from where it was expected, and by how much it
/// turned.
double distance_mm(const RegistrationResult& found, const Pose& expected) {
  const Difference d = difference(found, expected);
  return std::max(d.shift_mm.norm(), d.turn_mm.norm());
}

/// Says whether another pose is another place: it is farther away than half a period of the finest pattern.
/// Only axes that are observable count, because a pose further along a ridge is no other place.
bool is_elsewhere(const RegistrationResult& result, const Pose& other) {
  const Difference d = difference(result, other);
  for (int axis = 0; axis < 3; ++axis) {
    const auto k = static_cast<std::size_t>(axis);
    if (result.observable[k] && std::abs(d.shift_mm[axis]) > kMinPeriodMm / 2) return true;
    if (result.observable[3 + k] && std::abs(d.turn_mm[axis]) > kMinPeriodMm / 2) return true;
  }
  return false;
}

/// Says whether all motions are observable but that along z, which comes from the heights. If one is not, the
/// part of the object that the target shows is not known.
bool is_located(const RegistrationResult& registration) {
  for (std::size_t axis = 0; axis < registration.observable.size(); ++axis)
    if (axis != 2 && !registration.observable[axis]) return false;
  return true;
}

}  // namespace

RegistrationResult relocalize(const NormalFlowReference& reference, const Surface& target,
                              const Pose& expected, const RegistrationResult& failed,
                              const NormalFlowOptions& normal_flow, const VerificationOptions& options) {
  std::vector<RegistrationResult> candidates;
  NormalFlowOptions from_start = normal_flow;
  from_start.max_iterations = std::min(from_start.max_iterations, kStartIterations);
  PosePrior prior(expected);
  for (const Pose& start : coarse_starts(reference.surface(), target, expected, options)) {
    prior.start = start;
    const RegistrationResult candidate = register_normal_flow(reference, target, prior, from_start);
    const bool expected_there = distance_mm(candidate, expected) <= kMinPeriodMm;
    if ((expected_there || is_located(candidate)) &&
        verify_registered(reference, target, candidate, PlacePrior::unknown, options).ok())
      candidates.push_back(candidate);
  }
  if (candidates.empty()) return failed;
  RegistrationResult best =
      *std::min_element(candidates.begin(), candidates.end(),
                        [](const auto& a, const auto& b) { return a.normal_rmse_rad < b.normal_rmse_rad; });
  // Differences that are smaller than the noise of normals say nothing.
  const double rival_rmse_rad =
      options.rival_residual * std::max(best.normal_rmse_rad, shared_noise(reference.surface(), target) *
                                                                  normal_flow.normal_noise_rad);
  const auto is_rival = [&](const RegistrationResult& candidate) {
    return candidate.normal_rmse_rad < rival_rmse_rad && is_elsewhere(best, candidate.target_T_reference);
  };
  if (std::any_of(candidates.begin(), candidates.end(), is_rival))
    best.status = RegistrationStatus::ambiguous;
  return best;
}

}  // namespace gelslam
