#pragma once

#include "gelslam/registration/normal_flow.hpp"
#include "normal_flow_reference.hpp"

namespace gelslam::registration::detail {

using Vector5d = Eigen::Matrix<double, kParameters, 1>;
using Matrix5d = Eigen::Matrix<double, kParameters, kParameters>;

/// Holds what the gradients of the normals say about the five motions, over the shared contact. A read
/// gradient is the object's and noise; the object's is found again in the target, noise is not.
struct TextureAgreement {
  Matrix5d read = Matrix5d::Zero();  ///< Σ w JᵀJ: the object and noise
  /// Σ w JᵀJ' with J' from the target's gradients, made symmetric: the object alone.
  Matrix5d common = Matrix5d::Zero();
  Matrix5d pattern = Matrix5d::Zero();  ///< what moves with the gel (the model's unevenness) adds to both
};

/// `target_T_reference` is the pose of the residuals.
TextureAgreement compare_texture(const Samples& samples, const Surface& target,
                                 const Pose& target_T_reference, const Residuals& residuals,
                                 double gel_pattern_per_mm);

/// Five motions that are independent of each other, and what both surfaces show of each. A motion's part
/// along one of them is dual_basis.col(i) * motion.
struct ObservableDirections {
  Matrix5d basis = Matrix5d::Identity(), dual_basis = Matrix5d::Identity();
  /// The share of the gradient that was read along each direction that both surfaces show, 0..1. The rest is
  /// noise.
  Vector5d signal_fraction = Vector5d::Ones();
  Vector5d pattern_fraction = Vector5d::Zero();  ///< of this, how much may move with the gel: 0..1
};

/// `by_chance` is the share that noise alone would show.
ObservableDirections observable_directions(const TextureAgreement& texture, double by_chance);

/// The weighted normal equations of one warp.
struct NormalEquations {
  Eigen::Matrix<double, kParameters, kParameters> hessian;
  Eigen::Matrix<double, kParameters, 1> gradient;
};
NormalEquations linearize(const Samples& samples, const Viewpoint& view, const Residuals& residuals);

int count_shared(const Residuals& residuals);

/// Returns the matrix that takes right perturbations of a pose about a point to those about the origin; for
/// -point, it takes them back.
inline Matrix6d origin_from_center(const Eigen::Vector3d& center_mm) {
  Matrix6d matrix = Matrix6d::Identity();
  matrix.bottomLeftCorner<3, 3>() = skew(center_mm);
  return matrix;
}

/// Neighboring normals share their noise over such an area: 5 x 5 pixels of a GelSight Mini.
inline constexpr double kNoisePatchMm2 = 0.1005;

/// Returns the variance of one normal, given the residual of the registration.
double normal_variance(double normal_rmse_rad, const NormalFlowOptions& options);

/// Returns the variance of one component of a normal in a sum over all samples, which is larger because
/// neighbors share their noise.
double variance_in_sums(double normal_rmse_rad, const NormalFlowReference::Impl& reference,
                        const NormalFlowOptions& options);

/// Says whether residuals between normals are more than noise: three standard deviations of a normal.
inline bool is_far_above_noise(double normal_rmse_rad, const NormalFlowOptions& options) {
  return normal_rmse_rad > 3 * options.normal_noise_rad;
}

/// The difference between the heights of the target and those of the warped samples, over the shared contact.
struct HeightGap {
  double mean_mm = 0;  ///< what tz still lacks
  double rmse_mm = 0;  ///< about the mean
};
HeightGap height_gap(const Samples& samples, const Surface& target, const Pose& target_T_reference,
                     const Residuals& residuals);

/// Fills SCR, CCS, rms values, information, observability and status from the residuals at the final pose.
/// Returns what the two surfaces show.
ObservableDirections assess(const NormalFlowReference::Impl& reference, const Surface& target,
                            const Residuals& residuals, const PosePrior& prior,
                            const NormalFlowOptions& options, RegistrationResult& result);

/// Returns the information of a registered pose, in the order and axes of RegistrationResult::information.
/// The normals tell the observable directions, the heights z at the shared center, and both err with the
/// motion between the two frames: a slope that is read too steep turns every roll by its share, and what
/// belongs to the gel pulls towards no motion. (Own.)
Matrix6d pose_information(const ObservableDirections& directions, double shared_mm2, double slope_sigma_ratio,
                          double noise_variance, const PosePrior& prior, const RegistrationResult& result,
                          const NormalFlowOptions& options);

}  // namespace gelslam::registration::detail
