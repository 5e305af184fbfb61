#pragma once

#include "gelslam/core/se3.hpp"

namespace gelslam {

/// A pose a_T_b with the covariance of its right perturbation: true = pose * exp(noise), along the axes of b,
/// in rad and mm, in the order of se3.hpp. All functions are correct to first order of the noise.
struct UncertainPose {
  Pose pose = Pose::Identity();
  Matrix6d covariance = Matrix6d::Zero();

  /// Returns b_T_a: true^-1 = pose^-1 * exp(-Ad(pose) * noise).
  UncertainPose inverse() const;

  /// Returns one standard deviation of the translation in its worst direction.
  double worst_sigma_mm() const;
};

/// Returns one standard deviation in the worst direction of any covariance, in its unit.
double worst_sigma(const Eigen::Matrix3d& covariance);

/// Composes two independent poses to a_T_c.
UncertainPose compose(const UncertainPose& a_T_b, const UncertainPose& b_T_c);

/// Makes a covariance or its inverse exactly symmetric, because sessions store only one triangle of it.
inline Matrix6d symmetric(const Matrix6d& matrix) { return 0.5 * (matrix + matrix.transpose()); }

/// Returns a covariance or its inverse in the order of files and streams, x y z rx ry rz, with millimeters
/// converted by the factor `per_mm`.
Matrix6d translation_first(const Matrix6d& rotation_first, double per_mm = 1);

/// Returns the information matrix of the inverse pose, as UncertainPose::inverse() does for covariances; it
/// may be singular.
Matrix6d information_of_inverse(const Matrix6d& information, const Pose& pose);

}  // namespace gelslam
