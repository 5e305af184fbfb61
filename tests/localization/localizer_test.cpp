#include "gelslam/localization/localizer.hpp"

#include <gtest/gtest.h>

#include "../loop_closure/texture.hpp"

namespace gelslam {
namespace {

using namespace test;

constexpr double kFrameS = 0.04;

/// cos(k x) waves look the same after half a turn about the origin.
Field half_turn_texture(std::uint64_t seed) {
  Waves texture = waves_of_any_place(seed);
  for (Waves::Wave& wave : texture.waves) wave.phase = 0;
  return relief(texture);
}

constexpr Contact kSmall{70, 52};  // 9 x 7 mm

/// Patches 3 mm apart on a strip of the texture, twisted so that no row of pixels is like the touches'.
std::vector<PosedSurface> map_of(const Field& texture, double from_x_mm, double to_x_mm, int first_id = 0) {
  std::vector<PosedSurface> map;
  for (double x = from_x_mm; x <= to_x_mm; x += 3) {
    const Pose pose = place(x, 0, 7 * x, 2, -1);
    map.push_back({first_id++, pose, feel(texture, pose, kSmall)});
  }
  return map;
}

struct TouchedMap {
  explicit TouchedMap(const std::vector<PosedSurface>& map)
      : localizer(std::make_shared<const SurfaceMap>(map, SlamOptions{}), SlamOptions{}) {}

  Localization at(const Field& texture, const Pose& map_T_sensor) {
    const int now = frame++;
    return *localizer.process(now, now * kFrameS, feel(texture, map_T_sensor, kSmall)).localization;
  }
  void lift() {
    auto bare = std::make_shared<Surface>(*feel(plane(), place(0, 0)));
    bare->contact_pixels = 0;
    bare->contact.setTo(0);
    for (int i = 0; i < 6; ++i, ++frame) localizer.process(frame, frame * kFrameS, bare);  // ends the trial
  }

  Localizer localizer;
  int frame = 0;
};

double error_mm(const PlaceHypothesis& found, const Pose& truth) {
  return pose_distance_mm(found.map_T_sensor.pose, truth, Eigen::Vector3d::Zero());
}

Pose half_turn() { return place(0, 0, 180) * Eigen::Translation3d(0, 0, -0.3); }

TEST(Localizer, FindsThePlaceAtTheFirstTouch) {
  const Field texture = random_texture(1);
  TouchedMap session(map_of(texture, -9, 9));
  for (const Pose& truth : {place(5.1, 0.7, 120, -3, 4), place(-7.3, -1, -75, 1, 2)}) {
    const Localization found = session.at(texture, truth);
    ASSERT_EQ(found.status, PlaceStatus::localized) << found.reason;
    EXPECT_GE(found.hypotheses.front().probability, 0.95);
    EXPECT_LT(error_mm(found.hypotheses.front(), truth), 0.05);
    session.lift();
  }
}

TEST(Localizer, SaysHowWrongThePoseMayBe) {
  const Field texture = random_texture(2);
  TouchedMap session(map_of(texture, -3, 3));
  const Pose truth = place(0.9, 0.4, 33, 2, 2);
  const Localization found = session.at(texture, truth);
  ASSERT_EQ(found.status, PlaceStatus::localized) << found.reason;
  const PlaceHypothesis& best = found.hypotheses.front();
  const Vector6d error = se3_log(best.map_T_sensor.pose.inverse() * truth);
  for (int axis = 0; axis < 6; ++axis) {
    EXPECT_GT(best.map_T_sensor.covariance(axis, axis), 0) << axis;
    EXPECT_LT(std::abs(error[axis]), 5 * std::sqrt(best.map_T_sensor.covariance(axis, axis))) << axis;
  }
}

TEST(Localizer, AnotherObjectIsNotInTheMap) {
  TouchedMap session(map_of(random_texture(3), -3, 3));
  const Field other = random_texture(4);
  for (int k = 0; k < 4; ++k) {
    const Localization found = session.at(other, place(0.3 * k, 0, 3 * k));
    EXPECT_EQ(found.status, PlaceStatus::unknown);
    EXPECT_FALSE(found.reason.empty());
  }
}

// A map that is not quite the object, as one of a mesh that a model with errors reads. The larger the
// contact, the better or worse it may correlate; a place that fits all the time does not become less certain
// by that.
TEST(Localizer, AFrameThatFitsALittleWorseSaysNothingAgainstThePlace) {
  int localized = 0;
  for (std::uint64_t seed = 20; seed < 28; ++seed) {
    const Field texture = random_texture(seed), of_map = together(texture, random_texture(seed + 100, 0.09));
    TouchedMap session(map_of(of_map, -3, 3));
    double most = 0;
    for (int k = 0; k < 8; ++k) {
      const int now = session.frame++;
      const Localization found =
          *session.localizer
               .process(now, now * kFrameS, feel(texture, place(0.5, 0.3, 20), {42.0 + 4 * k, 32.0 + 3 * k}))
               .localization;
      if (found.hypotheses.size() != 1) continue;
      EXPECT_GE(found.hypotheses.front().probability, most - 1e-3) << "seed " << seed << " frame " << k;
      most = found.hypotheses.front().probability;
      localized += found.status == PlaceStatus::localized;
    }
  }
  EXPECT_GT(localized, 10);
}

// A smooth ball looks the same everywhere, also in its own map.
TEST(Localizer, ASmoothSurfaceIsNeverLocalized) {
  const Field ball = [](const Eigen::Vector3d& p) { return sphere(20)(p - 20 * Eigen::Vector3d::UnitZ()); };
  TouchedMap session(map_of(ball, -3, 3));
  for (int k = 0; k < 5; ++k)
    EXPECT_NE(session.at(ball, place(0.1 * k, 0.2, 2 * k)).status, PlaceStatus::localized);
}

TEST(Localizer, ASymmetricObjectHasTwoEqualHypothesesHoweverLongItIsRolled) {
  const Field texture = half_turn_texture(5);
  TouchedMap session(map_of(texture, -9, 9));
  for (int k = 0; k < 15; ++k) {
    const Pose truth = place(2.5 + 0.3 * k, 0.5, 10 + 2 * k);
    const Localization found = session.at(texture, truth);
    ASSERT_EQ(found.status, PlaceStatus::ambiguous) << k << " " << found.reason;
    ASSERT_EQ(found.hypotheses.size(), 2u) << k;
    EXPECT_NEAR(found.hypotheses[0].probability, found.hypotheses[1].probability, 0.2);
    const std::size_t right = error_mm(found.hypotheses[0], truth) < 0.1 ? 0 : 1;
    EXPECT_LT(error_mm(found.hypotheses[right], truth), 0.1);
    EXPECT_LT(error_mm(found.hypotheses[1 - right], half_turn() * truth), 0.1);
  }
}

// Two places look alike, but what lies beside them does not.
TEST(Localizer, RollingOnDecidesBetweenHypotheses) {
  const Field texture = half_turn_texture(6);
  std::vector<PosedSurface> map = map_of(random_texture(7), -12, -6);
  for (const PosedSurface& patch : map_of(texture, -3, 12, 100)) map.push_back(patch);
  TouchedMap session(map);
  Localization found = session.at(texture, place(2, 0, 10));
  EXPECT_EQ(found.status, PlaceStatus::ambiguous);
  EXPECT_EQ(found.hypotheses.size(), 2u);
  Pose truth;
  for (int k = 0; k < 20; ++k) found = session.at(texture, truth = place(2 + 0.4 * k, 0, 10));
  ASSERT_EQ(found.status, PlaceStatus::localized) << found.reason;
  EXPECT_LT(error_mm(found.hypotheses.front(), truth), 0.1);
}

TEST(Localizer, ThePoseInTheMapDoesNotDrift) {
  const Field texture = random_texture(8);
  TouchedMap session(map_of(texture, -6, 6));
  double first_mm = 0, last_mm = 0;
  constexpr int kFrames = 60;
  for (int k = 0; k < kFrames; ++k) {
    const double phase = 2 * M_PI * k / (kFrames / 2);
    const Pose truth = place(4 * std::sin(phase), std::sin(2 * phase), 20 * std::sin(phase));
    const Localization found = session.at(texture, truth);
    ASSERT_EQ(found.status, PlaceStatus::localized) << k << " " << found.reason;
    (k < kFrames / 2 ? first_mm : last_mm) += error_mm(found.hypotheses.front(), truth) / (kFrames / 2);
  }
  EXPECT_LT(last_mm, 1.1 * first_mm + 0.002);
}

TEST(Localizer, BeyondTheMapItSaysSoAndComesBack) {
  const Field texture = random_texture(9);
  TouchedMap session(map_of(texture, -6, 0));
  std::vector<PlaceStatus> states;
  for (int k = 0; k <= 60; ++k) {
    const double x = -3 + 11 * std::sin(M_PI * k / 60);
    const Localization found = session.at(texture, place(x, 0, 10));
    states.push_back(found.status);
    if (found.status == PlaceStatus::localized) {
      EXPECT_LT(error_mm(found.hypotheses.front(), place(x, 0, 10)), 0.1) << k;
    }
  }
  EXPECT_EQ(states.front(), PlaceStatus::localized);
  EXPECT_EQ(states[30], PlaceStatus::unknown);
  EXPECT_EQ(states.back(), PlaceStatus::localized);
}

TEST(SurfaceMap, LooksAlikeWhereItIsSymmetric) {
  const Field texture = half_turn_texture(5);
  const SurfaceMap map(map_of(texture, -9, 9), {});
  const Pose truth = place(5.1, 0.7, 120, -1, 1), other = half_turn() * truth;
  const MapFit fit =
      map.fit(NormalFlowReference(feel(texture, truth, kSmall), {}), {truth}, PlacePrior::odometry);
  ASSERT_TRUE(fit.ok());
  const std::vector<Pose> places = map.similar_places(fit);
  for (const Pose& expected : {truth, other})
    EXPECT_TRUE(std::any_of(places.begin(), places.end(), [&](const Pose& found) {
      return pose_distance_mm(found, expected, Eigen::Vector3d::Zero()) < 0.2;
    }));
  for (const Pose& found : places)
    EXPECT_LT(std::min(pose_distance_mm(found, truth, Eigen::Vector3d::Zero()),
                       pose_distance_mm(found, other, Eigen::Vector3d::Zero())),
              0.2);
}

TEST(SurfaceMap, ATouchFarFromTheMapIsNotCoveredWhateverTheLimit) {
  const Field texture = random_texture(1);
  SlamOptions options;
  options.verification.curvature.min_scr = 0;
  const SurfaceMap map(map_of(texture, 0, 3), options);
  const NormalFlowReference touch(feel(texture, place(0, 0), kSmall), options.registration);
  EXPECT_FALSE(map.fit(touch, {place(500, 0)}, PlacePrior::odometry).covered);
}

}  // namespace
}  // namespace gelslam
