#include "gelslam/registration/slope_sensitivity.hpp"

#include <gtest/gtest.h>

#include <Eigen/Cholesky>

#include "../support/analytic_surface.hpp"

namespace gelslam {
namespace {

using namespace test;

const Field kStone = bumpy_ellipsoid(3);
const Pose kFirst = pressed(6, 0.9);

/// The stone slid and rolled, as a hand does: the place that both see lies elsewhere on the gel, at another
/// tilt.
Pose moved(double rx_deg, double ry_deg, double x_mm, double y_mm) {
  return kFirst * motion(rx_deg, ry_deg, 4, x_mm, y_mm);
}

struct Pair {
  SurfacePtr reference, target;
  Pose truth = Pose::Identity();  // target_T_reference

  RegistrationResult registered() const { return register_normal_flow({reference, {}}, *target, truth, {}); }
  Pair with(const SlopeCorrection& correction) const {
    SlopeCorrector corrector;
    return {corrector.apply(*reference, correction), corrector.apply(*target, correction), truth};
  }
  SlopeSensitivity sensitivity(const RegistrationResult& result) const {
    return slope_sensitivity({reference, {}}, *target, result.target_T_reference, {});
  }
};

Pair pair(const Pose& first, const Pose& second) {
  return {touch(kStone, first), touch(kStone, second), second.inverse() * first};
}

// The derivative against what registration itself does when both surfaces are changed. Heights change with
// the slopes, too, and are not in the derivative: parallax makes up to a fifth, and 0.01 rad per
// unit where a patch as a whole is bent.
TEST(SlopeSensitivity, APoseFollowsEachFactorAsRegistrationDoes) {
  const Pair read = pair(kFirst, moved(5, -4, 0.6, -0.5));
  const RegistrationResult before = read.registered();
  ASSERT_TRUE(before.ok());
  const SlopeSensitivity sensitivity = read.sensitivity(before);
  constexpr double kStep = 0.02;
  for (std::size_t k = 0; k < SlopeCorrection::kTerms; ++k) {
    SlopeCorrection correction;
    correction.factors[k] = kStep;
    const RegistrationResult after = read.with(correction).registered();
    ASSERT_TRUE(after.ok());
    const Vector6d found = se3_log(before.target_T_reference.inverse() * after.target_T_reference) / kStep;
    const Vector6d predicted = sensitivity.pose_by_factor.col(static_cast<int>(k));
    EXPECT_LT((found - predicted).head<3>().norm(), 0.2 * predicted.head<3>().norm() + 0.01) << k;
    EXPECT_LT((found - predicted).tail<3>().head<2>().norm(), 0.1) << k;  // 2 micrometers in this step
    // A gain lifts a pose by less than the 0.02 to 0.03 mm that holding the shared center's height would
    // take.
    const bool is_gain = k == 0 || k == SlopeCorrection::kTermsPerAxis + 1;
    EXPECT_LT(std::abs(found[5] - predicted[5]), is_gain ? 0.015 : 0.1) << k;
  }
}

TEST(SlopeSensitivity, APlantedUnevennessIsReadFromResidualsAlone) {
  SlopeCorrection planted;  // slopes along x read 15 % too flat at the right, slopes along y by gx * gy
  planted.factors[2] = -0.15;
  planted.factors[SlopeCorrection::kTermsPerAxis + 7] = 0.3;
  const Pose poses[] = {kFirst, moved(0, 0, 1.5, 0), moved(0, 0, -1.5, 1), moved(8, 0, 0, 0.8),
                        moved(0, -8, -0.8, -1)};
  SlopeCorrection opposite;
  for (std::size_t k = 0; k < planted.factors.size(); ++k) opposite.factors[k] = -planted.factors[k];
  SlopeCorrector corrector;
  std::vector<SurfacePtr> touches;
  for (const Pose& pose : poses) touches.push_back(corrector.apply(*touch(kStone, pose), opposite));
  Eigen::MatrixXd hessian =
      1e-3 * Eigen::MatrixXd::Identity(SlopeSensitivity::kTerms, SlopeSensitivity::kTerms);
  Eigen::VectorXd pull = Eigen::VectorXd::Zero(SlopeSensitivity::kTerms);
  for (std::size_t b = 0; b < touches.size(); ++b)
    for (std::size_t a = 0; a < b; ++a) {
      const Pair read{touches[a], touches[b], poses[b].inverse() * poses[a]};
      const RegistrationResult result = read.registered();
      if (!result.ok()) continue;
      const SlopeSensitivity sensitivity = read.sensitivity(result);
      hessian += sensitivity.hessian;
      pull += sensitivity.pull;
    }
  const Eigen::VectorXd found = hessian.ldlt().solve(pull);
  EXPECT_NEAR(found[2], -0.15, 0.05);
  EXPECT_NEAR(found[static_cast<int>(SlopeCorrection::kTermsPerAxis) + 7], 0.3, 0.1);
}

TEST(SlopeSensitivity, NoiseDoesNotSayThatFlatterIsTrue) {
  const Pair clean = pair(kFirst, moved(5, -4, 0.6, -0.5));
  const Pair noisy{with_noise(*clean.reference, 0.05, 1), with_noise(*clean.target, 0.05, 2), clean.truth};
  const SlopeSensitivity sensitivity = noisy.sensitivity(noisy.registered());
  const double gain_said = sensitivity.pull[0] / sensitivity.hessian(0, 0);
  EXPECT_LT(std::abs(gain_said), 0.2);  // 1 where each normal's own noise is taken for slope
}

TEST(SlopeSensitivity, TwoLooksFromOnePlaceTellNothing) {
  const Pair same = pair(kFirst, kFirst);
  const SlopeSensitivity sensitivity = same.sensitivity(same.registered());
  EXPECT_GT(sensitivity.weight, 100);
  EXPECT_LT(sensitivity.hessian.cwiseAbs().maxCoeff(), 1e-6 * sensitivity.weight);
  EXPECT_LT(sensitivity.pose_by_factor.cwiseAbs().maxCoeff(), 1e-3);
}

TEST(SlopeSensitivity, NothingSharedIsNothingTold) {
  const Pair apart = pair(kFirst, kFirst);
  const SlopeSensitivity sensitivity =
      slope_sensitivity({apart.reference, {}}, *apart.target, motion(0, 0, 0, 50, 0), {});
  EXPECT_EQ(sensitivity.weight, 0);
  EXPECT_TRUE(sensitivity.pose_by_factor.isZero(0));
  EXPECT_TRUE(
      slope_sensitivity({apart.reference, {}}, *apart.target, motion(90, 0, 0, 0, 0), {}).hessian.isZero(0));
}

}  // namespace
}  // namespace gelslam
