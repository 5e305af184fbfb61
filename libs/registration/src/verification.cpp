// Decides whether two registered surfaces show the same place (own; docs/algorithms.md, Verification).
//
// The tests follow a registration that converged with enough shared curvature (SCR) and agreeing curvature
// (CCS; Huang, Kaess, Yuan, RA-L 2024). Texture: the correlation of both curvatures without their means over
// the shared contact, with a limit that is the higher the less was known of the pose; none for an odometry
// prior. Free space: the share of either contact that would lie inside gel that the other frame saw bare.
// Self-similarity, before the registration: a surface that looks like itself after a shift proves no place,
// unless the prior knows the pose to kObservableSigmaMm.
//
// Two places with the same texture and surroundings within one contact cannot be told apart here.
// Loops are therefore compared with each other as well (backend/src/loop_layers.cpp).

#include "gelslam/registration/verification.hpp"

#include <algorithm>
#include <cmath>
#include <optional>

#include "gelslam/registration/relocalization.hpp"
#include "texture_spectrum.hpp"

namespace gelslam {
namespace {

using namespace registration::detail;

// The largest share of two contacts that lies in the other's bare gel by chance: on clean logs, rendered and
// real, none is as large.
constexpr double kMaxContradicted = 0.1;

/// Counts every kTextureShrink-th pixel of `from` in contact that lands on the image of `onto`, and how many
/// of these would lie inside its bare gel.
struct ProjectedContact {
  int all = 0, in_bare_gel = 0;
};

ProjectedContact project_contact(const Surface& from, const Surface& onto, const Pose& onto_T_from) {
  constexpr double kToleranceMm = 0.15;  // heights and the membrane rim err by less
  const double tolerance_mm = kToleranceMm * shared_noise(from, onto);
  const CameraModel onto_camera = onto.camera();
  ProjectedContact projected;
  for (int v = 0; v < from.contact.rows; v += kTextureShrink)
    for (int u = 0; u < from.contact.cols; u += kTextureShrink) {
      if (!from.contact(v, u)) continue;
      const Eigen::Vector3d p = onto_T_from * from.point_mm({u, v});
      const std::optional<cv::Point> at = onto_camera.pixel_at(p);
      if (!at) continue;
      ++projected.all;
      projected.in_bare_gel += !onto.contact(*at) && p.z() < onto.height_mm(*at) - tolerance_mm;
    }
  return projected;
}

/// Returns the share (0..1) of either contact, as far as the other picture covers it, that would have to lie
/// inside the bare gel of the other: an object there would have been felt.
double free_space_violation(const Surface& reference, const Surface& target, const Pose& target_T_reference) {
  const ProjectedContact there = project_contact(reference, target, target_T_reference),
                         back = project_contact(target, reference, target_T_reference.inverse());
  const int all = there.all + back.all;
  return all > 0 ? static_cast<double>(there.in_bare_gel + back.in_bare_gel) / all : 0.0;
}

double min_texture_correlation(PlacePrior prior, const VerificationOptions& options) {
  if (prior == PlacePrior::odometry) return -1.0;
  return prior == PlacePrior::loop_candidate ? options.min_texture_correlation
                                             : options.sure_texture_correlation;
}

/// SCR asks how much of the reference is found again. A smaller target may lie in it entirely: then the
/// question is put the other way round.
bool shows_all_of(const NormalFlowReference& target, const NormalFlowReference& reference,
                  const RegistrationResult& result, const NormalFlowOptions& options) {
  return result.status == RegistrationStatus::too_little_overlap &&
         target.surface().contact_pixels < reference.surface().contact_pixels &&
         judge_pose(target, reference.surface(), result.target_T_reference.inverse(), options).ok();
}

}  // namespace

RegistrationResult verify(const NormalFlowReference& reference, const NormalFlowReference& target,
                          const UncertainPose& target_T_reference, PlacePrior prior,
                          const NormalFlowOptions& registration, const VerificationOptions& options) {
  RegistrationResult result;
  result.target_T_reference = target_T_reference.pose;
  const auto repeats = [&](const NormalFlowReference& shown) {
    return shown.self_similarity() > options.max_self_similarity;
  };
  if ((prior != PlacePrior::odometry || target_T_reference.worst_sigma_mm() > kObservableSigmaMm) &&
      (repeats(reference) || repeats(target))) {
    result.status = RegistrationStatus::ambiguous;
    return result;
  }
  NormalFlowOptions gates = registration;
  gates.curvature = options.curvature;
  result = register_normal_flow(reference, target.surface(), target_T_reference, gates);
  if (shows_all_of(target, reference, result, gates)) result.status = RegistrationStatus::converged;
  return verify_registered(reference, target.surface(), result, prior, options);
}

RegistrationResult verify_registered(const NormalFlowReference& reference, const Surface& target,
                                     const RegistrationResult& registration, PlacePrior prior,
                                     const VerificationOptions& options) {
  RegistrationResult result = registration;
  if (!result.ok()) return result;
  if (result.texture_correlation < min_texture_correlation(prior, options))
    result.status = RegistrationStatus::curvature_mismatch;
  else if (free_space_violation(reference.surface(), target, result.target_T_reference) > kMaxContradicted)
    result.status = RegistrationStatus::free_space_violation;
  return result;
}

}  // namespace gelslam
