#pragma once

#include <memory>

#include "gelslam/registration/registration.hpp"
#include "gelslam/surface/stored_surface.hpp"
#include "gelslam/surface/surface.hpp"

namespace gelslam {

/// The noise of both slopes, taken to be that of the noisier surface, in units of Surface::slope_noise_ratio.
double shared_noise(const Surface& a, const Surface& b);

/// The options of NormalFlow. Values with a unit hold for a surface with a slope_noise_ratio of 1, and grow
/// with it.
struct NormalFlowOptions {
  int max_samples = 3000;  // pixels of the reference's contact
  int max_iterations = 50;
  int min_iterations = 2;
  int min_shared_samples = 10;  // fewer hardly determine five numbers
  CurvatureLimits curvature;
  double robust_scale_rad = 0.05;  ///< Cauchy scale on normal residuals: dirt and scratches move with the gel
  double normal_noise_rad = 0.02;  ///< least standard deviation of one normal
  double height_noise_mm = 0.004;  ///< standard deviation of the mean height over a contact
  /// Relative error of the length of a roll, because slopes are read too steep or too flat.
  double gradient_scale_error = 0.06;
};

/// Says how much a surface looks like itself after a shift of at least a millimeter, -1..1: the largest
/// normalized cross-correlation of its curvature (mean removed) with itself over shifts that keep half of the
/// contact shared. Near 1 for a knurl, a cloth or a straight ridge: registration then succeeds at several
/// places. Source: own; masked correlation after Padfield, IEEE TIP 2012.
double self_similarity(const Surface& surface);

/// Holds the self-similarity of a surface, which is computed when it is first asked for. References of one
/// surface share it.
struct SelfSimilarity;
using SelfSimilarityPtr = std::shared_ptr<SelfSimilarity>;
SelfSimilarityPtr make_self_similarity();

/// Holds what is computed once per keyframe: samples, their points, normals, and how normals change over the
/// surface (inverse compositional; Baker & Matthews 2004; Huang et al., RA-L 2024, §IV). Immutable, shareable
/// between threads.
class NormalFlowReference {
 public:
  NormalFlowReference(SurfacePtr surface, const NormalFlowOptions& options,
                      SelfSimilarityPtr self_similarity = make_self_similarity());
  ~NormalFlowReference();
  NormalFlowReference(NormalFlowReference&&) noexcept;
  const Surface& surface() const;
  int sample_count() const;
  /// self_similarity() of the surface, computed when it is first asked for. Thread-safe.
  double self_similarity() const;

  struct Impl;
  const Impl& impl() const { return *impl_; }

 private:
  std::unique_ptr<const Impl> impl_;
};

/// Holds what registration needs of a surface that is kept for long. It is made when it is asked for, and
/// kept for as long as somebody uses it or it was used a short while ago. Cheap to copy. Thread-safe.
class StoredReference {
 public:
  StoredReference() = default;                                        ///< none
  StoredReference(std::shared_ptr<const NormalFlowReference> ready);  ///< kept as it is
  StoredReference(StoredSurface surface, const NormalFlowOptions& options);

  explicit operator bool() const { return entry_ != nullptr; }
  /// It must not be called when there is none. Hold the result while you use it.
  std::shared_ptr<const NormalFlowReference> get() const;
  std::shared_ptr<const NormalFlowReference> operator->() const { return get(); }

 private:
  struct Entry;
  std::shared_ptr<Entry> entry_;
};

/// Finds the most probable pose: it aligns the reference's surface normals with the target's, weighed against
/// the prior by the information that both surfaces share. Never throws on weak data: the result's status says
/// what happened, and the pose is the best estimate either way.
RegistrationResult register_normal_flow(const NormalFlowReference& reference, const Surface& target,
                                        const PosePrior& prior, const NormalFlowOptions& options);

/// Judges a pose that another method found, by the same samples and limits. It fills everything in the result
/// but the iterations.
RegistrationResult judge_pose(const NormalFlowReference& reference, const Surface& target,
                              const Pose& target_T_reference, const NormalFlowOptions& options);

}  // namespace gelslam
