#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <numbers>

namespace gelslam {

/// `a_T_b` maps coordinates in frame b to coordinates in frame a; translations in millimeters.
using Pose = Eigen::Isometry3d;

/// Tangent vectors are (rx, ry, rz, tx, ty, tz): rotation in radians first, then translation in millimeters.
/// Information matrices have the same order.
using Vector6d = Eigen::Matrix<double, 6, 1>;
using Matrix6d = Eigen::Matrix<double, 6, 6>;

inline constexpr double kDegreesPerRadian = 180.0 / std::numbers::pi;

Eigen::Matrix3d skew(const Eigen::Vector3d& v);

/// Exponential and logarithm of SO(3) and SE(3) (right-hand rule; Barfoot, State Estimation for Robotics,
/// chapter on matrix Lie groups).
Eigen::Matrix3d so3_exp(const Eigen::Vector3d& omega_rad);
Eigen::Vector3d so3_log(const Eigen::Matrix3d& rotation);
Pose se3_exp(const Vector6d& xi);
Vector6d se3_log(const Pose& pose);

/// Adjoint of a pose for the tangent order above: a_T_b * exp(xi) = exp(Ad * xi) * a_T_b.
Matrix6d adjoint(const Pose& a_T_b);

/// Rotation angle of a pose, radians in [0, pi].
double rotation_angle_rad(const Pose& pose);

/// Re-orthonormalizes the rotation: products of many poses drift away from SO(3).
Pose normalized(const Pose& pose);

// Decompositions of small matrices. They are compiled here once, because each file that calls Eigen's
// templates takes 5 to 10 s longer to compile.

/// Eigenvalues in ascending order and unit eigenvectors (columns) of a symmetric matrix, of which only the
/// lower triangle is read.
struct SymmetricEigen {
  Eigen::VectorXd values;
  Eigen::MatrixXd vectors;
};
SymmetricEigen symmetric_eigen(const Eigen::MatrixXd& symmetric);
Matrix6d inverted(const Matrix6d& matrix);

/// Returns the rotation by the smallest angle that turns the z axis to `direction` (of any length but 0). For
/// -z it is 180 degrees about some axis in the xy plane.
Eigen::Matrix3d rotation_of_z_to(const Eigen::Vector3d& direction);

}  // namespace gelslam
