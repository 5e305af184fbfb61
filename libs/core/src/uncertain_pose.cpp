#include "gelslam/core/uncertain_pose.hpp"

#include <algorithm>
#include <cmath>

namespace gelslam {

UncertainPose UncertainPose::inverse() const {
  const Matrix6d to_start = adjoint(pose);
  return {pose.inverse(), to_start * covariance * to_start.transpose()};
}

double UncertainPose::worst_sigma_mm() const { return worst_sigma(covariance.bottomRightCorner<3, 3>()); }

double worst_sigma(const Eigen::Matrix3d& covariance) {
  return std::sqrt(std::max(symmetric_eigen(covariance).values.maxCoeff(), 0.0));
}

UncertainPose compose(const UncertainPose& a_T_b, const UncertainPose& b_T_c) {
  const Matrix6d to_end = adjoint(b_T_c.pose.inverse());
  return {a_T_b.pose * b_T_c.pose, to_end * a_T_b.covariance * to_end.transpose() + b_T_c.covariance};
}

Matrix6d information_of_inverse(const Matrix6d& information, const Pose& pose) {
  const Matrix6d from_start = adjoint(pose.inverse());
  return from_start.transpose() * information * from_start;
}

Matrix6d translation_first(const Matrix6d& rotation_first, double per_mm) {
  Matrix6d matrix;
  matrix << per_mm * per_mm * rotation_first.bottomRightCorner<3, 3>(),
      per_mm * rotation_first.bottomLeftCorner<3, 3>(), per_mm * rotation_first.topRightCorner<3, 3>(),
      rotation_first.topLeftCorner<3, 3>();
  return matrix;
}

}  // namespace gelslam
