#pragma once

#include <memory>

#include "gelslam/registration/registration.hpp"
#include "gelslam/surface/surface.hpp"

namespace gelslam {

struct NormalFlowOptions {
  int max_samples = 3000;  ///< reference pixels used
  int max_iterations = 50;
  int min_iterations = 2;
  double rotation_tolerance_rad = 1e-4;
  double translation_tolerance_mm = 1e-2;
  int min_shared_pixels = 10;
  double scr_threshold = 0.3;
  double ccs_threshold = 0.7;
  double robust_scale_rad = 0.05;  ///< Cauchy scale on normal residuals: dirt and scratches move with the gel
  double normal_noise_rad = 0.02;  ///< of one read normal, at least
  double noise_correlation_samples = 1.5;  ///< neighboring samples share their noise: so many count as one
  double height_noise_mm = 0.004;          ///< of the mean height over a contact
  /// share by which a roll comes out too long or short: slopes read too steep or flat
  double gradient_scale_error = 0.06;
  /// how far a pose is from its start, before looking: decides what is not shown
  double prior_rotation_rad = 0.2;
  double prior_translation_mm = 1.0;
  /// of what was read along a direction; so much and what chance gives must be in both
  double least_common_share = 0.05;
  double texture_to_follow = 0.35;       ///< correlation of both curvatures; above it no direction is held
  double gel_pattern_rad_per_mm = 0.12;  ///< change of the normal that may belong to the gel and stay with it
  double smooth_curvature_per_px = 0.02;  ///< rms; below it the texture is too faint for CCS to mean anything
  double smooth_normal_rmse_rad = 0.06;   ///< and normals have to agree this well instead
  double observable_sigma_rad = 0.05;     ///< a motion counts as observable when it is known better than this
  double observable_sigma_mm = 0.3;
};

/// What is computed once per keyframe: samples, their points and normals, and the Jacobian, which depends on
/// the reference only (inverse compositional; Baker & Matthews 2004; Huang et al., RA-L 2024, §IV).
/// Immutable, shareable between threads.
class NormalFlowReference {
 public:
  NormalFlowReference(SurfacePtr surface, const NormalFlowOptions& options);
  ~NormalFlowReference();
  NormalFlowReference(NormalFlowReference&&) noexcept;
  const Surface& surface() const;
  int sample_count() const;

  struct Impl;
  const Impl& impl() const { return *impl_; }

 private:
  std::unique_ptr<const Impl> impl_;
};

/// Aligns the reference's surface normals with the target's, from `initial` (target_T_reference). Never
/// throws on weak data: the result's status says what happened, and the pose is the best estimate either way.
RegistrationResult register_normal_flow(const NormalFlowReference& reference, const Surface& target,
                                        const Pose& initial, const NormalFlowOptions& options);

/// Measures a pose that another method found by the same samples and limits: everything in the result but the
/// pose itself and the iterations comes from looking at the two surfaces, laid upon each other as the pose
/// says.
RegistrationResult judge_pose(const NormalFlowReference& reference, const Surface& target,
                              const Pose& target_T_reference, const NormalFlowOptions& options);

}  // namespace gelslam
