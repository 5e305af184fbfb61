#include "gelslam/registration/verification.hpp"

namespace gelslam {

// Where both show less than one sample in so many, textures agree by chance.
constexpr int kLeastShare = 10;

RegistrationResult verify(const NormalFlowReference& reference, const NormalFlowReference& target,
                          const UncertainPose& target_T_reference, PlacePrior prior,
                          const NormalFlowOptions& registration, const VerificationOptions& options) {
  RegistrationResult result;
  result.target_T_reference = target_T_reference.pose;
  const auto repeats = [&](const NormalFlowReference& shown) {
    return shown.self_similarity() > options.max_self_similarity;
  };
  if ((prior != PlacePrior::known || target_T_reference.worst_sigma_mm() > kObservableSigmaMm) &&
      (repeats(reference) || repeats(target))) {
    result.status = RegistrationStatus::ambiguous;
    return result;
  }
  NormalFlowOptions by_texture = registration;
  by_texture.curvature = {-1, -1};
  by_texture.min_shared_samples = registration.max_samples / kLeastShare;
  return verify_registered(register_normal_flow(reference, target.surface(), target_T_reference, by_texture),
                           prior, options);
}

RegistrationResult verify_registered(RegistrationResult registration, PlacePrior prior,
                                     const VerificationOptions& options) {
  const double least =
      prior == PlacePrior::none ? options.sure_texture_correlation : options.min_texture_correlation;
  if (registration.ok() && registration.texture_correlation < least)
    registration.status = RegistrationStatus::curvature_mismatch;
  return registration;
}

}  // namespace gelslam
