#include "gelslam/registration/relocalization.hpp"

#include <algorithm>
#include <cmath>
#include <vector>

#include "gelslam/registration/coarse_start.hpp"
#include "gelslam/registration/overlap_agreement.hpp"

namespace gelslam {
namespace {

constexpr int kMostIterations = 30;  // from a start that is within a pixel or two

/// From one pose of the target to another: of the shared center, and by turning, along the target's axes.
struct Difference {
  Eigen::Vector3d shift_mm, turn_rad;
};

Difference difference(const RegistrationResult& from, const Pose& to) {
  const Pose& pose = from.target_T_reference;
  return {to * from.shared_center_mm - pose * from.shared_center_mm,
          so3_log(to.linear() * pose.linear().transpose())};
}

/// What lies in the other's bare gel would have been felt there.
bool contradicts(const RegistrationResult& result, const NormalFlowReference& reference,
                 const Surface& target, const RelocalizationOptions& options) {
  return compare_overlap(reference.surface(), target, result.target_T_reference.inverse())
             .free_space_violation > options.max_free_space_violation;
}

/// Agrees well enough to put another place in doubt.
bool is_rival(const RegistrationResult& result, const NormalFlowReference& reference, const Surface& target,
              const RelocalizationOptions& options) {
  return result.shared_pixels >= options.least_rival_shared * reference.sample_count() &&
         result.texture_correlation >= options.least_rival_texture &&
         result.height_rmse_mm <= options.max_height_rmse_mm &&
         !contradicts(result, reference, target, options);
}

/// Did nobody expect it there?
bool is_far(const RegistrationResult& result, const Pose& expected, const RelocalizationOptions& options) {
  const Difference d = difference(result, expected);
  return d.shift_mm.norm() > options.far_mm || d.turn_rad.norm() > options.far_rad;
}

/// Agrees well enough to be the place, as unexpected as it is.
bool is_place(const RegistrationResult& result, const Pose& expected, const RelocalizationOptions& options) {
  return result.ok() &&
         (result.texture_correlation >= options.far_texture || !is_far(result, expected, options));
}

/// Along an axis that is observable: further along a ridge is no other place.
bool is_elsewhere(const RegistrationResult& result, const Pose& other, const RelocalizationOptions& options) {
  const Difference d = difference(result, other);
  for (int axis = 0; axis < 3; ++axis) {
    const auto k = static_cast<std::size_t>(axis);
    if (result.observable[k] && std::abs(d.shift_mm[axis]) > options.other_place_mm) return true;
    if (result.observable[3 + k] && std::abs(d.turn_rad[axis]) > options.other_place_rad) return true;
  }
  return false;
}

}  // namespace

double innovation_mm(const RegistrationResult& found, const Pose& expected) {
  constexpr double kHandMmPerRad = 0.2 / 0.035;
  const Difference d = difference(found, expected);
  return std::max(d.shift_mm.norm(), kHandMmPerRad * d.turn_rad.norm());
}

RegistrationResult relocalize(const NormalFlowReference& reference, const Surface& target,
                              const Pose& expected, const RegistrationResult& found,
                              const NormalFlowOptions& normal_flow, const RelocalizationOptions& options) {
  NormalFlowOptions quick = normal_flow;
  quick.max_iterations = std::min(quick.max_iterations, kMostIterations);
  std::vector<RegistrationResult> places;
  if (found.ok() && !(is_far(found, expected, options) && contradicts(found, reference, target, options)))
    places.push_back(found);
  for (const Pose& start : coarse_starts(reference.surface(), target, expected)) {
    const RegistrationResult place = register_normal_flow(reference, target, start, quick);
    if (is_rival(place, reference, target, options)) places.push_back(place);
  }
  const RegistrationResult* best = nullptr;
  for (const RegistrationResult& place : places)
    if (is_place(place, expected, options) && (!best || place.normal_rmse_rad < best->normal_rmse_rad))
      best = &place;
  if (!best) {
    RegistrationResult none = found;
    if (found.ok()) none.status = RegistrationStatus::curvature_mismatch;
    return none;
  }
  // What is within the noise proves nothing.
  const double doubt_rad =
      options.rival_residual * std::max(best->normal_rmse_rad, normal_flow.normal_noise_rad);
  const double farthest_mm = options.rival_distance * innovation_mm(*best, expected);
  const bool doubtful = std::any_of(places.begin(), places.end(), [&](const RegistrationResult& place) {
    return place.normal_rmse_rad < doubt_rad && is_elsewhere(*best, place.target_T_reference, options) &&
           !(innovation_mm(place, expected) > farthest_mm);
  });
  RegistrationResult result = *best;
  if (doubtful) result.status = RegistrationStatus::ambiguous;
  return result;
}

}  // namespace gelslam
