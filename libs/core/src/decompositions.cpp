#include "gelslam/core/decompositions.hpp"

#include <Eigen/Eigenvalues>
#include <Eigen/Geometry>

namespace gelslam {

SymmetricEigen symmetric_eigen(const Matrix6d& symmetric) {
  const Eigen::SelfAdjointEigenSolver<Matrix6d> solver(symmetric);
  return {solver.eigenvalues(), solver.eigenvectors()};
}

Eigen::Matrix3d rotation_of_z_to(const Eigen::Vector3d& direction) {
  return Eigen::Quaterniond::FromTwoVectors(Eigen::Vector3d(0, 0, 1), direction).toRotationMatrix();
}

}  // namespace gelslam
