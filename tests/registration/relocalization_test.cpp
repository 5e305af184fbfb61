#include "gelslam/registration/relocalization.hpp"

#include <gtest/gtest.h>

#include "../support/analytic_surface.hpp"

namespace gelslam {
namespace {

using namespace test;

const Pose kHere = motion(0, 0, 0, 0, 0, 0.4);

struct Search {
  RegistrationResult alone, place;
};

/// Searches for the sensor, which is at the pose `moved` now, while the expected pose is that of no motion.
Search search(const Field& field, const Pose& moved, const View& view = everywhere()) {
  const NormalFlowOptions options;
  const NormalFlowReference reference(touch(field, kHere, view), options);
  const SurfacePtr target = touch(field, moved, view);
  Search s;
  s.alone = register_normal_flow(reference, *target, Pose::Identity(), options);
  s.place = relocalize(reference, *target, Pose::Identity(), s.alone, options, {});
  return s;
}

/// The motions are far larger than NormalFlow can follow; the waves of the texture are 1 to 3 mm long.
TEST(Relocalization, FindsMotionsThatNormalFlowAloneDoesNot) {
  for (const Pose& moved :
       {motion(0, 0, 0, 4, 0, 0.4), motion(0, 0, 0, -2, 3, 0.4), motion(0, 0, 22, 0, 0, 0.4),
        motion(4, -3, -18, 2, 2, 0.45), motion(6, 2, 9, -3, -2, 0.4)}) {
    const Search s = search(textured_plane(7), moved);
    EXPECT_FALSE(s.alone.ok()) << "no need to look";
    EXPECT_TRUE(s.place.ok());
    expect_within(gap(s.place.target_T_reference, moved.inverse() * kHere), 0.1, 0.02);
  }
}

TEST(Relocalization, LooksAboutTheTwistThatIsExpected) {
  const Pose far = motion(0, 0, 70, 1, 0, 0.4);
  const SurfacePtr here = touch(textured_plane(9), kHere), there = touch(textured_plane(9), far);
  const std::vector<Pose> starts = coarse_starts(*here, *there, motion(0, 0, -60, 0, 0));
  ASSERT_FALSE(starts.empty());
  EXPECT_LT(gap(starts.front(), far.inverse() * kHere).deg, 5.0) << "twists are looked for 7 degrees apart";
  EXPECT_TRUE(coarse_starts(*here, *there, Pose::Identity()).empty());
}

TEST(Relocalization, WhatSlidesAlongARidgeIsAtNoOtherPlace) {
  // Ridges along y: the height is a sum of waves along x without a common period, and constant along y.
  const Field ridges = [](const Eigen::Vector3d& p) {
    double height = 0, slope = 0, phase = 0;
    for (const double k : {2.1, 2.9, 3.7, 4.6}) {
      height += 0.02 * std::cos(k * p.x() + phase);
      slope -= 0.02 * k * std::sin(k * p.x() + phase);
      phase += 1.3;
    }
    return std::pair{p.z() - height, Eigen::Vector3d(-slope, 0, 1)};
  };
  const Search s = search(ridges, motion(0, 0, 0, 0.3, 0, 0.4));
  EXPECT_TRUE(s.place.ok());
  EXPECT_NEAR(s.place.target_T_reference.translation().x(), -0.3, 0.02);
  // Farther away, it cannot be known which part of the ridges is seen.
  EXPECT_FALSE(search(ridges, motion(0, 0, 0, 3, 0, 0.4)).place.ok());
}

TEST(Relocalization, APatternThatRepeatsItselfIsAmbiguous) {
  const Field waffle = [](const Eigen::Vector3d& p) {
    const double k = 2 * M_PI / 2.5;  // periods of 2.5 mm
    const double height = 0.06 * (std::cos(k * p.x()) + std::cos(k * p.y()));
    return std::pair{p.z() - height,
                     Eigen::Vector3d(0.06 * k * std::sin(k * p.x()), 0.06 * k * std::sin(k * p.y()), 1)};
  };
  const Search s = search(waffle, motion(0, 0, 10, 4.6, 1.2, 0.4));
  EXPECT_FALSE(s.alone.ok()) << "no need to look";
  EXPECT_EQ(s.place.status, RegistrationStatus::ambiguous);
}

TEST(Relocalization, WhereTheObjectWouldHaveBeenFeltItIsNot) {
  // The contact is smaller than the gel. At the right pose, each object would lie in gel that the other frame
  // saw bare.
  const Search s = search(textured_plane(7), motion(0, 0, 0, 4, 0, 0.4), View{});
  EXPECT_FALSE(s.place.ok());
}

TEST(Relocalization, AnotherObjectIsNoPlace) {
  const NormalFlowOptions options;
  for (std::uint64_t seed = 20; seed < 26; ++seed) {
    const NormalFlowReference reference(touch(textured_plane(seed), kHere), options);
    const SurfacePtr target = touch(textured_plane(seed + 100), kHere);
    EXPECT_FALSE(relocalize(reference, *target, Pose::Identity(), {}, options, {}).ok()) << seed;
  }
}

}  // namespace
}  // namespace gelslam
