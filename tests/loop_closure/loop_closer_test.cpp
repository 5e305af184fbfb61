#include "gelslam/loop_closure/loop_closer.hpp"

#include <gtest/gtest.h>

#include "gelslam/core/error.hpp"
#include "gelslam/core/se3.hpp"
#include "texture.hpp"

namespace gelslam {
namespace {

using namespace test;

/// Verifies a given relative pose as if it was a loop candidate.
std::optional<PoseGraphEdge> verify_guess(const Keyframe& older, const Keyframe& newer,
                                          const Pose& older_T_newer) {
  return verify_loop(older, newer, older_T_newer, {}, {});
}

PoseGap error_of(const PoseGraphEdge& loop, const Pose& map_T_from, const Pose& map_T_to) {
  return gap(loop.from_T_to, map_T_from.inverse() * map_T_to);
}

// Adds a trial with one keyframe at each place, so that only loops can join them. Returns the loops that are
// found.
std::vector<PoseGraphEdge> visit(LoopCloser& closer, const Field& texture, const std::vector<Pose>& places) {
  std::vector<PoseGraphEdge> all;
  for (std::size_t i = 0; i < places.size(); ++i) {
    const int id = static_cast<int>(i);
    for (const PoseGraphEdge& loop : closer.add(keyframe(id, id, feel(texture, places[i]))))
      all.push_back(loop);
  }
  return all;
}

TEST(LoopCloser, FindsAPlaceAgainAcrossTrialsWithTheRightPose) {
  const std::vector<Pose> places{place(0, 0), place(40, 0), place(0, 50), place(0.9, -0.6, 25, 2, -3)};
  LoopCloser closer({});
  const std::vector<PoseGraphEdge> loops = visit(closer, random_texture(1), places);
  ASSERT_EQ(loops.size(), 1u);
  EXPECT_EQ(loops[0].from, 0);
  EXPECT_EQ(loops[0].to, 3);
  // Without noise, the error of a registration is a fraction of a pixel over the contact.
  expect_within(error_of(loops[0], places[0], places[3]), 0.5, kPitchMm / 2);
}

TEST(LoopCloser, FindsAPlaceTurnedUpsideDownInTheImage) {
  const std::vector<Pose> places{place(0, 0), place(0.4, 0.3, 180)};
  LoopCloser closer({});
  const std::vector<PoseGraphEdge> loops = visit(closer, random_texture(2), places);
  ASSERT_EQ(loops.size(), 1u);
  EXPECT_LT(error_of(loops[0], places[0], places[1]).deg, 0.5);
}

TEST(LoopCloser, DifferentPlacesAreNotConfused) {
  std::vector<Pose> places;
  for (int i = 0; i < 12; ++i) places.push_back(place(30.0 * i, 17.0 * i, 20.0 * i));
  LoopCloser closer({});
  EXPECT_TRUE(visit(closer, random_texture(3), places).empty());
}

// It cannot be known which of the many equal bumps was touched, so no loop may be found.
TEST(LoopCloser, ARepeatedPatternClaimsNothing) {
  LoopCloser closer({});
  EXPECT_TRUE(visit(closer, grid_texture(), {place(0, 0), place(7.7, 3.2), place(0.4, 20.1, 30)}).empty());
}

TEST(LoopCloser, SkipsTheLastKeyframesOfTheTrialOnly) {
  const Field texture = random_texture(4);
  LoopCloser closer({});
  for (int id = 0; id <= 12; ++id)
    EXPECT_TRUE(closer.add(keyframe(id, 0, feel(texture, place(0.05 * id, 0)))).empty()) << id;
  const std::vector<PoseGraphEdge> same_trial = closer.add(keyframe(13, 0, feel(texture, place(0.6, 0))));
  ASSERT_EQ(same_trial.size(), 1u) << "13 keyframes ago";
  EXPECT_EQ(same_trial[0].from, 0);
  EXPECT_FALSE(closer.add(keyframe(14, 1, feel(texture, place(0.3, 0)))).empty());
}

TEST(LoopCloser, NeighborsDoNotCrowdOutAPlaceFoundAgain) {
  const Field texture = random_texture(4);
  LoopClosureOptions options;
  options.max_constraints = 3;
  LoopCloser closer(options);
  closer.add(keyframe(0, 0, feel(texture, place(0, 0))));
  std::vector<PoseGraphEdge> loops;
  for (int i = 1; i < 12; ++i) loops = closer.add(keyframe(i, 1, feel(texture, place(12 - i, 0))));
  ASSERT_EQ(loops.size(), 1u);
  EXPECT_EQ(loops[0].from, 0);
}

TEST(LoopCloser, VerifiesAGuessFromElsewhereAndRefusesAWrongOne) {
  const Field texture = random_texture(7);
  const Pose first = place(0, 0), second = place(0.8, 0.5, 10, 2, 1);
  const Keyframe older = keyframe(3, 0, feel(texture, first)), newer = keyframe(9, 1, feel(texture, second));
  const Pose off = se3_exp((Vector6d() << 0.02, -0.02, 0.03, 0.1, -0.1, 0.05).finished());
  const std::optional<PoseGraphEdge> loop = verify_guess(older, newer, first.inverse() * second * off);
  ASSERT_TRUE(loop);
  EXPECT_EQ(loop->from, 3);
  EXPECT_EQ(loop->to, 9);
  EXPECT_LT(error_of(*loop, first, second).deg, 0.5);
  EXPECT_FALSE(verify_guess(older, keyframe(10, 1, feel(texture, place(25, 8))), Pose::Identity()));
}

// By their texture, the two surfaces show the same place. But one of them shows bare gel where the object
// pressed the other, which is impossible.
TEST(LoopCloser, BareGelWhereTheObjectShouldBeRefutesALoop) {
  const Field texture = random_texture(7);
  const Pose first = place(0, 0), second = place(0.8, 0.5, 10, 2, 1);
  const SurfacePtr whole = feel(texture, second);
  const auto half = std::make_shared<Surface>(*whole);
  half->contact = whole->contact.clone();
  half->height_mm = whole->height_mm.clone();
  const cv::Rect left(0, 0, 130, 240);
  half->contact(left) = 0;
  half->contact_pixels = cv::countNonZero(half->contact);
  const Keyframe older = keyframe(0, 0, feel(texture, first));
  const Pose guess = first.inverse() * second;
  EXPECT_TRUE(
      verify_guess(older, keyframe(1, 1, half), guess));  // pressed there, though not counted as contact
  half->height_mm(left) = 0.0F;
  EXPECT_FALSE(verify_guess(older, keyframe(1, 1, half), guess));
  EXPECT_FALSE(verify_guess(keyframe(0, 0, half), keyframe(1, 1, feel(texture, first)), guess.inverse()));
}

// The first touch of a trial is often small, and a later contact may contain all of it. The loop must be
// found whichever of the two is the reference.
TEST(LoopCloser, ASmallContactInALargeOneIsFoundWhicheverCameFirst) {
  const Field texture = random_texture(7);
  const Contact small{40, 32};
  const Pose first = place(0, 0), second = place(0.8, 0.5, 10, 2, 1);
  const auto loop = [&](const Contact& a, const Contact& b) {
    return verify_guess(keyframe(0, 0, feel(texture, first, a)), keyframe(1, 1, feel(texture, second, b)),
                        first.inverse() * second);
  };
  for (const auto& found : {loop(small, {}), loop({}, small)}) {
    ASSERT_TRUE(found);
    expect_within(error_of(*found, first, second), 0.5, kPitchMm / 2);
  }
}

// Two balls agree at every pose, so the registration succeeds. Their texture is sensor noise and does not
// agree.
TEST(LoopCloser, ABallIsNoEvidence) {
  const auto ball = [](std::uint64_t noise_seed) {
    const SurfacePtr smooth = feel(plane(), place(0, 0));
    auto surface = std::make_shared<Surface>(*smooth);
    surface->normals = smooth->normals.clone();
    surface->curvature = smooth->curvature.clone();
    cv::RNG random(noise_seed);
    for (int v = 0; v < 240; ++v)
      for (int u = 0; u < 320; ++u) {
        if (!surface->contact(v, u)) continue;
        const double gx = (u - 159.5) / 300, gy = (v - 119.5) / 300;
        const Eigen::Vector3d n = Eigen::Vector3d(-gx, -gy, 1).normalized();
        surface->normals(v, u) = cv::Vec3d(n.x(), n.y(), n.z());
        surface->curvature(v, u) = static_cast<float>(2.0 / 300 + random.gaussian(0.003));
      }
    return surface;
  };
  const Keyframe older = keyframe(0, 0, ball(1)), newer = keyframe(1, 1, ball(2));
  ASSERT_TRUE(register_normal_flow(*newer.reference.get(), *older.surface.get(), Pose::Identity(), {}).ok());
  EXPECT_FALSE(verify_guess(older, newer, Pose::Identity()));
}

TEST(LoopCloser, RefusesNonsense) {
  LoopClosureOptions options;
  options.min_sift_inliers = 1;
  EXPECT_THROW(LoopCloser{options}, Error);
  LoopCloser closer({});
  const SurfacePtr surface = feel(random_texture(1), place(0, 0));
  closer.add(keyframe(5, 0, surface));
  EXPECT_THROW(closer.add(keyframe(5, 0, surface)), Error);
}

}  // namespace
}  // namespace gelslam
