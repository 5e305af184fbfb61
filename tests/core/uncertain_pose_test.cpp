#include "gelslam/core/uncertain_pose.hpp"

#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <random>

namespace gelslam {
namespace {

/// A right perturbation that is 3 times as large along some directions as along others.
UncertainPose uncertain(std::mt19937_64& random) {
  std::uniform_real_distribution<double> number(-1, 1);
  const auto numbers = [&] { return Vector6d(Vector6d::NullaryExpr([&] { return number(random); })); };
  Vector6d twist = numbers();
  twist.tail<3>() *= 5;  // mm
  UncertainPose result{se3_exp(twist), Matrix6d::Zero()};
  for (int i = 0; i < 6; ++i) {
    const Vector6d cause = 0.003 * (i % 2 + 0.5) * numbers();
    result.covariance += cause * cause.transpose();
  }
  return result;
}

class Draws {
 public:
  explicit Draws(const UncertainPose& from) : from_(from), factor_(from.covariance.llt().matrixL()) {}
  Pose operator()(std::mt19937_64& random) {
    std::normal_distribution<double> normal;
    const Vector6d unit = Vector6d::NullaryExpr([&] { return normal(random); });
    return from_.pose * se3_exp(factor_ * unit);
  }

 private:
  UncertainPose from_;
  Matrix6d factor_;
};

/// Covariance of the right perturbations that lead from `mean` to poses.
template <class Draw>
Matrix6d sampled(const Pose& mean, Draw draw) {
  constexpr int kDraws = 20000;
  Matrix6d sum = Matrix6d::Zero();
  for (int i = 0; i < kDraws; ++i) {
    const Vector6d error = se3_log(mean.inverse() * draw());
    sum += error * error.transpose();
  }
  return sum / kDraws;
}

// Of 20 000 draws a variance is known to 1 %; what is left out is of second order, 0.005 rad of it.
constexpr double kTolerance = 0.05;

double relative_gap(const Matrix6d& a, const Matrix6d& b) { return (a - b).norm() / b.norm(); }

TEST(UncertainPose, TheInverseHasTheCovarianceOfInvertedDraws) {
  std::mt19937_64 random(1);
  for (int trial = 0; trial < 5; ++trial) {
    const UncertainPose a_T_b = uncertain(random), b_T_a = a_T_b.inverse();
    Draws draw(a_T_b);
    EXPECT_LT(
        relative_gap(b_T_a.covariance, sampled(a_T_b.pose.inverse(), [&] { return draw(random).inverse(); })),
        kTolerance);
    EXPECT_LT(relative_gap(b_T_a.inverse().covariance, a_T_b.covariance), 1e-9);
    EXPECT_LT(relative_gap(information_of_inverse(a_T_b.covariance.inverse(), a_T_b.pose).inverse(),
                           b_T_a.covariance),
              1e-6);
  }
}

TEST(UncertainPose, ACompositionHasTheCovarianceOfComposedDraws) {
  std::mt19937_64 random(2);
  for (int trial = 0; trial < 5; ++trial) {
    const UncertainPose a = uncertain(random), b = uncertain(random);
    Draws draw_a(a), draw_b(b);
    EXPECT_LT(relative_gap(compose(a, b).covariance,
                           sampled(a.pose * b.pose, [&] { return Pose(draw_a(random) * draw_b(random)); })),
              kTolerance);
  }
}

}  // namespace
}  // namespace gelslam
