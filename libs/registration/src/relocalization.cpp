// Finds the pose of a frame on a reference after a registration from the expected pose has failed. This is
// not in the papers.
//
// coarse_starts() proposes at most six poses at which the textures agree. Each is refined by a registration
// of at most kStartIterations steps, and tested by verify_registered() with PlacePrior::unknown. If it is
// farther than kMinPeriodMm from the expected pose, all its motions except z must be observable. Of the
// candidates that pass, the one with the smallest residual of the normals is accepted.
//
// The status is `ambiguous` if another pose, farther away than half a period along an observable axis, fits
// nearly as well (VerificationOptions::rival_residual). If no candidate passes, the failed registration is
// returned. A pose whose twist differs from the expected one by more than about 20 degrees is not found.

#include "gelslam/registration/relocalization.hpp"

#include <algorithm>
#include <cmath>

namespace gelslam {
namespace {

constexpr int kStartIterations = 15;  // from a right initial pose, fewer suffice

/// The difference between two poses of the target in the axes of the target: the motion of the shared center,
/// and the rotation vector times kMmPerRad.
struct Difference {
  Eigen::Vector3d shift_mm, turn_mm;
};

Difference difference(const RegistrationResult& from, const Pose& to) {
  const Pose& pose = from.target_T_reference;
  return {to * from.shared_center_mm - pose * from.shared_center_mm,
          kMmPerRad * so3_log(to.linear() * pose.linear().transpose())};
}

/// Returns how far a pose is from the expected one: the larger of the motion of the shared center and of the
/// rotation times kMmPerRad, in mm.
double distance_mm(const RegistrationResult& found, const Pose& expected) {
  const Difference d = difference(found, expected);
  return std::max(d.shift_mm.norm(), d.turn_mm.norm());
}

/// Returns whether another pose is at another place: it differs by more than half of the shortest period
/// along an observable axis. Axes that are not observable do not count, because a pose that is shifted along
/// a ridge, for example, shows the same place.
bool is_elsewhere(const RegistrationResult& result, const Pose& other) {
  const Difference d = difference(result, other);
  for (int axis = 0; axis < 3; ++axis) {
    const auto k = static_cast<std::size_t>(axis);
    if (result.observable[k] && std::abs(d.shift_mm[axis]) > kMinPeriodMm / 2) return true;
    if (result.observable[3 + k] && std::abs(d.turn_mm[axis]) > kMinPeriodMm / 2) return true;
  }
  return false;
}

/// Returns whether all motions except z, which follows from the heights, are observable. Otherwise the pose
/// does not determine which part of the object the target shows.
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
  // Residuals below the noise of normals cannot be distinguished.
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
