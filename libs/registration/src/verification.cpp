// Decides whether two surfaces show the same place (docs/algorithms.md, Verification). Except for the
// registration, this is not in the papers. There are four tests:
//
// 1. Self-similarity: a surface that looks like itself after a shift cannot prove a place. It is rejected,
//    unless the pose is already known with a standard deviation of at most kObservableSigmaMm.
// 2. Registration: it has to converge, with enough shared curvature (SCR) and agreeing curvatures (CCS;
//    Huang, Kaess, Yuan, RA-L 2024).
// 3. Texture: the correlation coefficient of both curvatures over the shared contact has to exceed a limit,
//    which is higher the less was known of the pose. There is no limit for an odometry prior.
// 4. Free space: only a small part of either contact may lie inside gel that the other frame saw bare.
//
// Two places that have the same texture over a whole contact cannot be distinguished here. Loops are
// therefore also compared with each other (backend/src/loop_layers.cpp).

#include "gelslam/registration/verification.hpp"

#include <optional>

#include "gelslam/registration/relocalization.hpp"
#include "texture_spectrum.hpp"

namespace gelslam {
namespace {

using namespace registration::detail;

// The largest fraction of two contacts that may lie in bare gel of the other frame. On rendered and real logs
// without errors it is always smaller.
constexpr double kMaxContradicted = 0.1;

/// The number of pixels of one contact (every kTextureShrink-th along both axes) that fall on the picture of
/// the other frame, and how many of these would lie inside its bare gel.
struct ProjectedContact {
  int all = 0, in_bare_gel = 0;
};

ProjectedContact project_contact(const Surface& from, const Surface& onto, const Pose& onto_T_from) {
  constexpr double kToleranceMm = 0.15;  // the errors of heights, and of the draped gel, are smaller
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

/// Returns the fraction (0..1) of both contacts that would lie inside bare gel of the other frame, of those
/// parts that the other picture covers. An object there would have been felt.
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

/// Returns whether a registration that failed for its small overlap succeeds with the roles of the surfaces
/// exchanged. SCR is the fraction of the reference that the target shows, and is small if a small target lies
/// entirely in the reference. Then the fraction of the target that the reference shows has to be tested.
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
