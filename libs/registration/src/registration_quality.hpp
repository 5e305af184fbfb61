#pragma once

#include "gelslam/registration/normal_flow.hpp"
#include "normal_flow_reference.hpp"

namespace gelslam::registration::detail {

using Vector5d = Eigen::Matrix<double, kParameters, 1>;
using Matrix5d = Eigen::Matrix<double, kParameters, kParameters>;

/// Holds information matrices of the five motions, summed over the shared contact. The gradients of the
/// normals that are read consist of the object's and of noise. The object's gradients are found again in the
/// target; noise is not, so the product of both surfaces' gradients contains the object alone.
struct TextureAgreement {
  Matrix5d read = Matrix5d::Zero();  ///< Σ w JᵀJ: of the object and noise
  /// Σ w JᵀJ', where J' has the target's gradients, made symmetric: of the object alone.
  Matrix5d common = Matrix5d::Zero();
  Matrix5d pattern = Matrix5d::Zero();  ///< what a gel pattern (docs/glossary.md) may add to both
};

/// `target_T_reference` is the pose of the residuals.
TextureAgreement compare_texture(const Samples& samples, const Surface& target,
                                 const Pose& target_T_reference, const Residuals& residuals,
                                 double gel_pattern_per_mm);

/// Five directions of motion whose information is independent, and the share of it that both surfaces show.
/// The component of a motion along direction i is dual_basis.col(i) · motion.
struct ObservableDirections {
  Matrix5d basis = Matrix5d::Identity(), dual_basis = Matrix5d::Identity();
  /// For each direction, the share of the information in `read` that is also in `common`, 0..1. The rest is
  /// noise.
  Vector5d signal_fraction = Vector5d::Ones();
  Vector5d pattern_fraction = Vector5d::Zero();  ///< the part of it that a gel pattern may cause, 0..1
};

/// Solves the generalized eigenvalue problem (common, read + pattern). `by_chance`: the eigenvalue that noise
/// alone would have; it is subtracted.
ObservableDirections observable_directions(const TextureAgreement& texture, double by_chance);

/// The weighted normal equations of one warp.
struct NormalEquations {
  Eigen::Matrix<double, kParameters, kParameters> hessian;
  Eigen::Matrix<double, kParameters, 1> gradient;
};
NormalEquations linearize(const Samples& samples, const Viewpoint& view, const Residuals& residuals);

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
  double mean_mm = 0;  ///< the correction of tz
  double rmse_mm = 0;  ///< root mean square about the mean
};
HeightGap height_gap(const Samples& samples, const Surface& target, const Pose& target_T_reference,
                     const Residuals& residuals);

/// Fills SCR, CCS, rms values, information, observability and status from the residuals at the final pose.
/// Returns the directions of motion that both surfaces show.
ObservableDirections assess(const NormalFlowReference::Impl& reference, const Surface& target,
                            const Residuals& residuals, const PosePrior& prior,
                            const NormalFlowOptions& options, RegistrationResult& result);

/// Returns the information of a registered pose, in the order and axes of RegistrationResult::information.
/// The normals have information about the observable directions, and the heights about z at the center of the
/// shared contact. To the noise of both the variance of errors is added that grow with the motion between the
/// two frames: slopes that are read too steep make a roll too large by the same share, and a gel pattern
/// makes every motion too small. This covariance is not in the papers.
Matrix6d pose_information(const ObservableDirections& directions, double shared_mm2, double slope_sigma_ratio,
                          double noise_variance, const PosePrior& prior, const RegistrationResult& result,
                          const NormalFlowOptions& options);

}  // namespace gelslam::registration::detail
