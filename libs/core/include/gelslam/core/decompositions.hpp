#pragma once

#include <Eigen/Core>

#include "gelslam/core/se3.hpp"

/// Decompositions of small matrices, compiled once: each of them costs every file that calls Eigen's template
/// 5 to 10 s of compile time.
namespace gelslam {

/// Eigenvalues, ascending, and unit eigenvectors (columns) of a symmetric matrix, of which the lower half is
/// read.
struct SymmetricEigen {
  Vector6d values;
  Matrix6d vectors;
};
SymmetricEigen symmetric_eigen(const Matrix6d& symmetric);

/// The rotation by the smallest angle that turns the z axis to `direction` (any length but 0); 180 degrees
/// about some axis of the xy plane for -z.
Eigen::Matrix3d rotation_of_z_to(const Eigen::Vector3d& direction);

}  // namespace gelslam
