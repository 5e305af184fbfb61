#include "judgement.hpp"

#include <gtest/gtest.h>

namespace gelslam::lab {
namespace {

using Seen = std::array<bool, 6>;
constexpr Seen kAll = {true, true, true, true, true, true};

Pose pose(const Eigen::Vector3d& mm, const Eigen::Vector3d& deg) {
  Pose result = Pose::Identity();
  result.linear() = so3_exp(deg * M_PI / 180);
  result.translation() = mm;
  return result;
}

const Pose kTruth = pose({1, -2, 0.3}, {10, 20, 80});

TEST(Judgement, TruthIsRight) {
  const Judgement judged = judge_pose_error(kTruth, kTruth, kAll, true);
  EXPECT_TRUE(judged.right && judged.shown_right && !judged.wrong && !judged.silent_failure());
  EXPECT_NEAR(judged.error_mm, 0, 1e-12);
}

TEST(Judgement, CountsErrorsAlongTheTargetsAxes) {
  for (int axis = 0; axis < 6; ++axis) {
    Eigen::Vector3d mm(0, 0, 0), deg(0, 0, 0);
    (axis < 3 ? mm : deg)[axis % 3] = axis < 3 ? 1.5 : 6.0;
    const Pose estimate = pose(mm, deg) * kTruth;
    Seen all_others = kAll;
    all_others[static_cast<std::size_t>(axis)] = false;
    EXPECT_TRUE(judge_pose_error(estimate, kTruth, kAll, true).silent_failure()) << axis;
    EXPECT_FALSE(judge_pose_error(estimate, kTruth, kAll, false).silent_failure()) << axis;
    const Judgement unseen = judge_pose_error(estimate, kTruth, all_others, true);
    EXPECT_FALSE(unseen.wrong) << axis;
    EXPECT_TRUE(unseen.shown_right) << axis;
    EXPECT_FALSE(unseen.right) << axis;
    EXPECT_NEAR(axis < 3 ? unseen.error_mm : unseen.error_deg, axis < 3 ? 1.5 : 6.0, 1e-9);
  }
}

TEST(Judgement, BetweenRightAndWrongIsNeither) {
  const Judgement judged = judge_pose_error(pose({0.5, 0, 0}, {0, 3, 0}) * kTruth, kTruth, kAll, true);
  EXPECT_FALSE(judged.right || judged.shown_right || judged.wrong);
}

}  // namespace
}  // namespace gelslam::lab
