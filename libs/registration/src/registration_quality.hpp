#pragma once

#include "gelslam/registration/normal_flow.hpp"
#include "normal_flow_reference.hpp"

namespace gelslam::registration::detail {

using Vector5d = Eigen::Matrix<double, kParameters, 1>;
using Matrix5d = Eigen::Matrix<double, kParameters, kParameters>;

/// Information matrices of the five parameters, summed over the shared contact. The gradients of the normals
/// contain the texture of the object and noise. In another frame the texture is the same, but the noise is
/// independent, so noise has no share in the products of the gradients of two frames.
struct TextureAgreement {
  Matrix5d read = Matrix5d::Zero();  ///< H = Σ w JᵀJ: texture and noise
  /// C = the symmetric part of Σ w JᵀJ', where J' has the gradients of the target: texture alone.
  Matrix5d common = Matrix5d::Zero();
  Matrix5d pattern = Matrix5d::Zero();  ///< G: what a gel pattern (docs/glossary.md) may contribute to both
};

/// Computes these matrices. `target_T_reference` is the pose at which the residuals were computed, and
/// `gel_pattern_per_mm` the change of the normals by a gel pattern in rad/mm.
TextureAgreement compare_texture(const Samples& samples, const Surface& target,
                                 const Pose& target_T_reference, const Residuals& residuals,
                                 double gel_pattern_per_mm);

/// Five independent directions of motion (the columns of `basis`), and how far both surfaces show each of
/// them. The component of a motion along direction i is the product of column i of `dual_basis` with the
/// motion.
struct ObservableDirections {
  Matrix5d basis = Matrix5d::Identity(), dual_basis = Matrix5d::Identity();
  /// For each direction, the fraction of the signal in the gradients that both surfaces share, 0..1. The rest
  /// is noise.
  Vector5d signal_fraction = Vector5d::Ones();
  Vector5d pattern_fraction = Vector5d::Zero();  ///< the fraction of it that a gel pattern may cause, 0..1
};

/// Computes the directions as the generalized eigenvectors of (common, read + pattern). Their signal
/// fractions are the eigenvalues minus `by_chance`, the eigenvalue that noise alone may have, limited to
/// 0..1.
ObservableDirections observable_directions(const TextureAgreement& texture, double by_chance);

/// The weighted normal equations of one Gauss-Newton step.
struct NormalEquations {
  Eigen::Matrix<double, kParameters, kParameters> hessian;  ///< Σ w JᵀJ
  Eigen::Matrix<double, kParameters, 1> gradient;           ///< Σ w Jᵀr
};
NormalEquations linearize(const Samples& samples, const Viewpoint& view, const Residuals& residuals);

/// Returns the number of samples with a weight, which fall on contact of the target.
int count_shared(const Residuals& residuals);

/// Returns the matrix that transforms right perturbations (rotation, translation) of a pose about a point
/// into those about the origin. For the negated point, it is the inverse.
inline Matrix6d origin_from_center(const Eigen::Vector3d& center_mm) {
  Matrix6d matrix = Matrix6d::Identity();
  matrix.bottomLeftCorner<3, 3>() = skew(center_mm);
  return matrix;
}

/// The noise of the normals is correlated over an area of this size, which is 5 x 5 pixels of a GelSight
/// Mini.
inline constexpr double kNoisePatchMm2 = 0.1005;

/// Returns the variance of one normal in rad². Its standard deviation is the root mean square residual of the
/// registration, and at least NormalFlowOptions::normal_noise_rad.
double normal_variance(double normal_rmse_rad, const NormalFlowOptions& options);

/// Returns the variance (rad²) of one component of a normal to be used with sums over all samples as if their
/// noise was independent. It is larger than that of a single normal, because the samples of a patch share
/// their noise.
double variance_in_sums(double normal_rmse_rad, const NormalFlowReference::Impl& reference,
                        const NormalFlowOptions& options);

/// Returns whether the root mean square residual of normals is above three standard deviations of their
/// noise.
inline bool is_far_above_noise(double normal_rmse_rad, const NormalFlowOptions& options) {
  return normal_rmse_rad > 3 * options.normal_noise_rad;
}

/// The difference between the heights of the target and those of the transformed samples, over the shared
/// contact.
struct HeightGap {
  double mean_mm = 0;  ///< the weighted mean, by which tz has to be corrected
  double rmse_mm = 0;  ///< the root mean square deviation from the mean
};
HeightGap height_gap(const Samples& samples, const Surface& target, const Pose& target_T_reference,
                     const Residuals& residuals);

/// Evaluates a registration from the residuals at its final pose, and sets SCR, CCS, the root mean square
/// values, information, observability and status of `result`. Returns the directions of motion and how far
/// both surfaces show them.
ObservableDirections assess(const NormalFlowReference::Impl& reference, const Surface& target,
                            const Residuals& residuals, const PosePrior& prior,
                            const NormalFlowOptions& options, RegistrationResult& result);

/// Returns the information of a registered pose, in the order and axes of RegistrationResult::information.
/// `shared_mm2` is the area of the shared contact, and `noise_variance` the result of variance_in_sums().
/// pose_information.cpp describes the model, which is not in the papers.
Matrix6d pose_information(const ObservableDirections& directions, double shared_mm2, double slope_sigma_ratio,
                          double noise_variance, const PosePrior& prior, const RegistrationResult& result,
                          const NormalFlowOptions& options);

}  // namespace gelslam::registration::detail
