#pragma once

#include "gelslam/core/se3.hpp"

namespace gelslam {

/// A pose a_T_b and the covariance of its right perturbation: true = pose * exp(noise), along the axes of b;
/// rad, mm, order as in se3.hpp. All functions are right to first order of the noise.
struct UncertainPose {
  Pose pose = Pose::Identity();
  Matrix6d covariance = Matrix6d::Zero();

  /// b_T_a. true^-1 = pose^-1 * exp(-Ad(pose) * noise).
  UncertainPose inverse() const;

  /// One standard deviation of the translation in its worst direction.
  double worst_sigma_mm() const;
};

/// The same of any covariance, and in its unit.
double worst_sigma(const Eigen::Matrix3d& covariance);

/// a_T_b and b_T_c, independent of each other, to a_T_c.
UncertainPose compose(const UncertainPose& a_T_b, const UncertainPose& b_T_c);

/// A covariance or its inverse made exactly symmetric, without rounding differences of its halves: sessions
/// keep only one half.
inline Matrix6d symmetric(const Matrix6d& matrix) { return 0.5 * (matrix + matrix.transpose()); }

/// A covariance or its inverse as files and streams have it: x y z rx ry rz, and millimeters as another unit.
Matrix6d translation_first(const Matrix6d& rotation_first, double per_mm = 1);

/// UncertainPose::inverse() of an inverse covariance, which may be singular.
Matrix6d information_of_inverse(const Matrix6d& information, const Pose& pose);

}  // namespace gelslam
