#include <gtest/gtest.h>

#include "../support/analytic_surface.hpp"
#include "gelslam/registration/relocalization.hpp"

namespace gelslam {
namespace {

using namespace test;

const Pose kAtRest = motion(0, 0, 0, 0, 0, 0.4);

/// Twist, slide and tilt far beyond what NormalFlow follows (a wave of the texture is 1 to 3 mm long).
const std::vector<Pose> kJumps = {motion(0, 0, 0, 4, 0, 0.4), motion(0, 0, 0, -2, 3, 0.4),
                                  motion(0, 0, 22, 0, 0, 0.4), motion(4, -3, -18, 2, 2, 0.45),
                                  motion(6, 2, 9, -3, -2, 0.4)};

// A coarse pixel is 0.25 mm, and twists are 7 degrees apart: a start is within a pixel or two at the
// contact's middle and within half a step. NormalFlow needs no more.
constexpr double kStartMm = 0.4, kStartDeg = 5.0;

PoseGap gap_at(const Pose& a, const Pose& b, const Eigen::Vector3d& point_mm) {
  return {gap(a, b).deg, (a * point_mm - b * point_mm).norm()};
}

TEST(CoarseStart, FindsMotionsThatNormalFlowAloneDoesNot) {
  const Field field = textured_plane(7);
  const SurfacePtr reference = touch(field, kAtRest);
  const NormalFlowOptions options;
  const NormalFlowReference prepared(reference, options);
  for (const Pose& jump : kJumps) {
    const SurfacePtr target = touch(field, jump);
    const Pose truth = jump.inverse() * kAtRest;
    const std::vector<Pose> starts = coarse_starts(*reference, *target, Pose::Identity());
    ASSERT_FALSE(starts.empty());
    expect_within(gap_at(starts.front(), truth, truth.inverse() * Eigen::Vector3d(0, 0, -0.4)), kStartDeg,
                  kStartMm);
    const RegistrationResult found = register_normal_flow(prepared, *target, starts.front(), options);
    EXPECT_TRUE(found.ok());
    expect_within(gap(found.target_T_reference, truth), 0.1, 0.02);
    EXPECT_FALSE(register_normal_flow(prepared, *target, Pose::Identity(), options).ok())
        << "no need to look";
  }
}

TEST(CoarseStart, TheWayBackIsTheInverse) {
  const Field field = textured_plane(8);
  const SurfacePtr here = touch(field, kAtRest), there = touch(field, kJumps[3]);
  const std::vector<Pose> out = coarse_starts(*here, *there, Pose::Identity()),
                          back = coarse_starts(*there, *here, Pose::Identity());
  ASSERT_FALSE(out.empty());
  ASSERT_FALSE(back.empty());
  expect_within(gap_at(out.front() * back.front(), Pose::Identity(), {0, 0, -0.4}), 2 * kStartDeg,
                2 * kStartMm);
}

TEST(CoarseStart, LooksAboutTheTwistThatIsExpected) {
  const Field field = textured_plane(9);
  const Pose far = motion(0, 0, 70, 1, 0, 0.4);
  const SurfacePtr reference = touch(field, kAtRest), target = touch(field, far);
  const std::vector<Pose> starts = coarse_starts(*reference, *target, motion(0, 0, -60, 0, 0));
  ASSERT_FALSE(starts.empty());
  EXPECT_LT(gap(starts.front(), far.inverse() * kAtRest).deg, kStartDeg);
  EXPECT_TRUE(coarse_starts(*reference, *target, Pose::Identity()).empty());
}

TEST(CoarseStart, APatternThatRepeatsItselfHasManyPlaces) {
  constexpr double kPeriodMm = 1.6;
  const Field pattern = waffle(kPeriodMm);
  const std::vector<Pose> starts = coarse_starts(
      *touch(pattern, kAtRest), *touch(pattern, motion(0, 0, 0, 2, 0.5, 0.4)), Pose::Identity());
  int untwisted = 0;
  for (const Pose& start : starts) {
    if (gap(start, Pose::Identity()).deg > 1) continue;
    ++untwisted;
    const double periods_x = (start.translation().x() + 2) / kPeriodMm,
                 periods_y = (start.translation().y() + 0.5) / kPeriodMm;
    EXPECT_NEAR(periods_x, std::round(periods_x), 0.2);
    EXPECT_NEAR(periods_y, std::round(periods_y), 0.2);
  }
  EXPECT_GE(untwisted, 2);
}

}  // namespace
}  // namespace gelslam
