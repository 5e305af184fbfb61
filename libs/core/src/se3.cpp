// Exponential and logarithm of rotations and rigid motions, and the adjoint (Sola, Deray, Atchuthan, A micro
// Lie theory for state estimation in robotics, 2018). A tangent vector xi = (w, v) has the rotation w (rad)
// first: exp(xi) has the rotation exp([w]x) by Rodrigues' formula and the translation J(w) v, where J is the
// left Jacobian. For small angles the coefficients are replaced by their Taylor series.

#include "gelslam/core/se3.hpp"

#include <Eigen/Eigenvalues>
#include <Eigen/LU>
#include <cmath>

namespace gelslam {
namespace {

// The coefficients of the left Jacobian J = I + a [w]x + b [w]x²: a = (1 - cos |w|) / |w|² and
// b = (|w| - sin |w|) / |w|³.
struct LeftJacobianCoefficients {
  double a, b;
};

LeftJacobianCoefficients left_jacobian_coefficients(double angle) {
  if (angle < 1e-5) return {0.5 - angle * angle / 24.0, 1.0 / 6.0 - angle * angle / 120.0};
  const double angle2 = angle * angle;
  return {(1.0 - std::cos(angle)) / angle2, (angle - std::sin(angle)) / (angle2 * angle)};
}

}  // namespace

Eigen::Matrix3d skew(const Eigen::Vector3d& v) {
  Eigen::Matrix3d m;
  m << 0, -v.z(), v.y(), v.z(), 0, -v.x(), -v.y(), v.x(), 0;
  return m;
}

Eigen::Matrix3d so3_exp(const Eigen::Vector3d& omega_rad) {
  const double angle = omega_rad.norm();
  const Eigen::Matrix3d w = skew(omega_rad);
  const double sinc = angle < 1e-5 ? 1.0 - angle * angle / 6.0 : std::sin(angle) / angle;
  return Eigen::Matrix3d::Identity() + sinc * w + left_jacobian_coefficients(angle).a * w * w;
}

Eigen::Vector3d so3_log(const Eigen::Matrix3d& rotation) {
  Eigen::Quaterniond q(rotation);
  if (q.w() < 0) q.coeffs() = -q.coeffs();
  const double sin_half = q.vec().norm();
  if (sin_half < 1e-9) return 2.0 * q.vec();
  return 2.0 * std::atan2(sin_half, q.w()) / sin_half * q.vec();
}

Pose se3_exp(const Vector6d& xi) {
  const Eigen::Vector3d omega = xi.head<3>();
  const Eigen::Matrix3d w = skew(omega);
  const auto [a, b] = left_jacobian_coefficients(omega.norm());
  Pose pose = Pose::Identity();
  pose.linear() = so3_exp(omega);
  pose.translation() = (Eigen::Matrix3d::Identity() + a * w + b * w * w) * xi.tail<3>();
  return pose;
}

Vector6d se3_log(const Pose& pose) {
  const Eigen::Vector3d omega = so3_log(pose.linear());
  const Eigen::Matrix3d w = skew(omega);
  const auto [a, b] = left_jacobian_coefficients(omega.norm());
  const Eigen::Matrix3d left_jacobian = Eigen::Matrix3d::Identity() + a * w + b * w * w;
  Vector6d xi;
  xi << omega, left_jacobian.partialPivLu().solve(pose.translation());
  return xi;
}

Matrix6d adjoint(const Pose& a_T_b) {
  Matrix6d ad = Matrix6d::Zero();
  ad.topLeftCorner<3, 3>() = a_T_b.linear();
  ad.bottomRightCorner<3, 3>() = a_T_b.linear();
  ad.bottomLeftCorner<3, 3>() = skew(a_T_b.translation()) * a_T_b.linear();
  return ad;
}

double rotation_angle_rad(const Pose& pose) { return so3_log(pose.linear()).norm(); }

Pose normalized(const Pose& pose) {
  Pose result = pose;
  result.linear() = Eigen::Quaterniond(pose.linear()).normalized().toRotationMatrix();
  return result;
}

SymmetricEigen symmetric_eigen(const Eigen::MatrixXd& symmetric) {
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> solver(symmetric);
  return {solver.eigenvalues(), solver.eigenvectors()};
}

Matrix6d inverted(const Matrix6d& matrix) { return matrix.inverse(); }

Eigen::Matrix3d rotation_of_z_to(const Eigen::Vector3d& direction) {
  const Eigen::Vector3d axis(-direction.y(), direction.x(), 0);
  const double length = axis.norm(), angle = std::atan2(length, direction.z());
  return so3_exp(length > 0 ? Eigen::Vector3d(angle / length * axis) : Eigen::Vector3d(angle, 0, 0));
}

}  // namespace gelslam
