#include "gelslam/core/se3.hpp"

#include <gtest/gtest.h>

#include <numbers>
#include <random>
#include <unsupported/Eigen/MatrixFunctions>

namespace gelslam {
namespace {

Vector6d random_twist(std::mt19937_64& random, double angle_rad) {
  std::uniform_real_distribution<double> unit(-1.0, 1.0);
  Vector6d xi;
  for (int i = 0; i < 6; ++i) xi[i] = unit(random);
  xi.head<3>() *= angle_rad / xi.head<3>().norm();
  return xi;
}

/// The Lie algebra element as a 4x4 matrix, whose matrix exponential is the pose by definition.
Eigen::Matrix4d hat(const Vector6d& xi) {
  Eigen::Matrix4d m = Eigen::Matrix4d::Zero();
  m.topLeftCorner<3, 3>() = skew(xi.head<3>());
  m.topRightCorner<3, 1>() = xi.tail<3>();
  return m;
}

TEST(Se3, ExponentialIsTheMatrixExponential) {
  std::mt19937_64 random(1);
  for (const double angle : {1e-9, 1e-6, 0.9e-5, 1.1e-5, 1e-3, 0.5, 2.0, 3.1}) {
    const Vector6d xi = random_twist(random, angle);
    const Eigen::Matrix4d expected = hat(xi).exp();
    EXPECT_TRUE(se3_exp(xi).matrix().isApprox(expected, 1e-10)) << angle;
  }
}

TEST(Se3, LogarithmInvertsExponential) {
  std::mt19937_64 random(2);
  for (const double angle : {1e-10, 1e-6, 1e-3, 1.0, 3.0, std::numbers::pi - 1e-6}) {
    const Vector6d xi = random_twist(random, angle);
    EXPECT_LT((se3_log(se3_exp(xi)) - xi).norm(), 1e-8) << angle;
    EXPECT_NEAR(rotation_angle_rad(se3_exp(xi)), angle, 1e-9);
  }
  EXPECT_EQ(se3_log(Pose::Identity()), Vector6d::Zero().eval());
}

TEST(Se3, AdjointMovesATwistThroughAPose) {
  std::mt19937_64 random(3);
  const Pose a_T_b = se3_exp(random_twist(random, 1.2));
  const Vector6d xi = random_twist(random, 0.7);
  const Pose left = a_T_b * se3_exp(xi);
  const Pose right = se3_exp(adjoint(a_T_b) * xi) * a_T_b;
  EXPECT_TRUE(left.isApprox(right, 1e-12));
}

TEST(Se3, NormalizedIsARotationAgain) {
  Pose drifted = se3_exp(Vector6d::Constant(0.3));
  drifted.linear() *= 1.001;
  EXPECT_FALSE((drifted.linear() * drifted.linear().transpose()).isIdentity(1e-6));
  const Pose pose = normalized(drifted);
  EXPECT_TRUE((pose.linear() * pose.linear().transpose()).isIdentity(1e-12));
  // Nearest up to the size of the drift; real drift is a millionth of this.
  EXPECT_LT(rotation_angle_rad(pose.inverse() * se3_exp(Vector6d::Constant(0.3))), 1e-3);
}

TEST(Se3, TurnsZToADirectionByTheSmallestAngle) {
  const Eigen::Vector3d z(0, 0, 1);
  for (const Eigen::Vector3d& direction :
       {Eigen::Vector3d(0.3, -0.2, 0.9), Eigen::Vector3d(-2, 1, -0.5), Eigen::Vector3d(1e-9, 0, 1),
        Eigen::Vector3d(1e-7, 1e-7, -1), z, Eigen::Vector3d(0, 0, -3)}) {
    const Eigen::Matrix3d rotation = rotation_of_z_to(direction);
    EXPECT_TRUE((rotation * rotation.transpose()).isIdentity(1e-12));
    EXPECT_TRUE((rotation * z).isApprox(direction.normalized(), 1e-9)) << direction.transpose();
    EXPECT_NEAR(so3_log(rotation).norm(), std::acos(direction.normalized().z()), 1e-7);
    EXPECT_NEAR(so3_log(rotation).z(), 0, 1e-9);
  }
}

}  // namespace
}  // namespace gelslam
