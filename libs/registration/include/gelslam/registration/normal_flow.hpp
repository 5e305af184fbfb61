#pragma once

#include <memory>

#include "gelslam/registration/registration.hpp"
#include "gelslam/surface/stored_surface.hpp"
#include "gelslam/surface/surface.hpp"

namespace gelslam {

/// Returns the noise that is assumed when two surfaces are compared: the larger of the two values of
/// Surface::slope_noise_ratio.
double shared_noise(const Surface& a, const Surface& b);

/// The options of NormalFlow. Values in rad or mm hold for surfaces with a slope_noise_ratio of 1. They are
/// multiplied by shared_noise(), except for gradient_scale_error.
struct NormalFlowOptions {
  int max_samples = 3000;  ///< the number of pixels of the reference's contact that are used
  int max_iterations = 50;
  int min_iterations = 2;
  int min_shared_samples = 10;  ///< fewer samples hardly determine five parameters
  CurvatureLimits curvature;
  /// The scale of the Cauchy kernel on the residuals of normals. Outliers are, for example, dirt and
  /// scratches, which move with the gel and not with the object.
  double robust_scale_rad = 0.05;
  double normal_noise_rad = 0.02;  ///< the smallest standard deviation of a normal that is assumed
  double height_noise_mm = 0.004;  ///< the standard deviation of the mean height over a contact
  /// The relative error of a measured roll or depth, because slopes are read too steep or too flat.
  double gradient_scale_error = 0.06;
};

/// Returns how similar a surface is to itself after a shift of at least kMinPeriodMm, from 0 to 1: the
/// largest normalized correlation of its curvature (without the mean) with itself, over all shifts for which
/// at least half of the contact overlaps. It is near 1 for a knurl, a cloth or a straight ridge, where a
/// registration would succeed at several places. The correlation is that of Padfield (IEEE TIP 2012), for
/// masked images; its use here is not in the papers.
double self_similarity(const Surface& surface);

/// A cache of the self-similarity of a surface, which is computed when it is first needed. All references
/// that are made of this surface share it.
struct SelfSimilarity;
using SelfSimilarityPtr = std::shared_ptr<SelfSimilarity>;
SelfSimilarityPtr make_self_similarity();

/// A reference surface, prepared for registration: the samples of its contact with their points, normals and
/// gradients of the normals. Because NormalFlow is inverse compositional (Baker and Matthews 2004; Huang et
/// al., RA-L 2024, §IV), these are computed once per keyframe. Immutable; can be shared between threads.
class NormalFlowReference {
 public:
  NormalFlowReference(SurfacePtr surface, const NormalFlowOptions& options,
                      SelfSimilarityPtr self_similarity = make_self_similarity());
  ~NormalFlowReference();
  NormalFlowReference(NormalFlowReference&&) noexcept;
  const Surface& surface() const;
  int sample_count() const;
  /// Returns gelslam::self_similarity() of the surface, which is computed at the first call. Thread-safe.
  double self_similarity() const;

  struct Impl;
  const Impl& impl() const { return *impl_; }

 private:
  std::unique_ptr<const Impl> impl_;
};

/// The NormalFlowReference of a surface that is kept for long. It is made when it is requested, and stays in
/// memory while it is used or was used recently. Cheap to copy. Thread-safe.
class StoredReference {
 public:
  StoredReference() = default;                                        ///< holds no reference
  StoredReference(std::shared_ptr<const NormalFlowReference> ready);  ///< keeps this reference in memory
  StoredReference(StoredSurface surface, const NormalFlowOptions& options);

  explicit operator bool() const { return entry_ != nullptr; }
  /// Returns the reference. There must be one. Keep the result as long as you use it.
  std::shared_ptr<const NormalFlowReference> get() const;
  std::shared_ptr<const NormalFlowReference> operator->() const { return get(); }

 private:
  struct Entry;
  std::shared_ptr<Entry> entry_;
};

/// Registers two surfaces by NormalFlow: finds the most probable pose target_T_reference, given the normals
/// and heights of both surfaces and the prior. It does not throw if the surfaces do not determine the pose;
/// the status of the result then says why, and the pose is the best estimate that was found.
RegistrationResult register_normal_flow(const NormalFlowReference& reference, const Surface& target,
                                        const PosePrior& prior, const NormalFlowOptions& options);

/// Evaluates a given pose by the same samples and limits as register_normal_flow(), without changing it. All
/// members of the result except `iterations` are computed.
RegistrationResult judge_pose(const NormalFlowReference& reference, const Surface& target,
                              const Pose& target_T_reference, const NormalFlowOptions& options);

}  // namespace gelslam
