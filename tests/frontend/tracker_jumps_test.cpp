// Tests the tracker with motions that cannot be predicted from the frames before: large ones, and motions
// over repeating patterns.

#include <gtest/gtest.h>

#include <array>

#include "gelslam/frontend/tracker.hpp"
#include "slides.hpp"

namespace gelslam {
namespace {

using namespace test;

TEST(Tracker, AfterAMotionTooLargeToFollowItLooksWhereTheTexturesAgree) {
  const auto field = textured_plane(5);
  const Pose jump = motion(3, -2, 25, 3.5, -2.2, 0.4);
  const SurfacePtr before = touch(field, motion(0, 0, 0, 0, 0, 0.4), everywhere()),
                   after = touch(field, jump, everywhere());
  for (const bool relocalize : {true, false}) {
    TrackerOptions options;
    options.relocalize = relocalize;
    Tracker tracker(options);
    tracker.track(0, 0, before);
    const TrackedFrame frame = tracker.track(1, 0.04, after);
    ASSERT_EQ(frame.status, relocalize ? TrackStatus::tracked : TrackStatus::lost);
    if (relocalize) expect_pose(frame.trial_T_frame, motion(0, 0, 0, 0, 0, 0.4).inverse() * jump, 1);
  }
}

constexpr double kPeriodMm = 1.6;

TEST(Tracker, APatternThatMovesAsAHandDoesIsFollowed) {
  Tracker tracker(TrackerOptions{});
  for (int i = 0; i < 16; ++i) {
    const Pose pose = motion(0, 0, 0.2 * i, 0.15 * i, -0.05 * i, 0.4);
    const TrackedFrame frame = tracker.track(i, 0.04 * i, touch(waffle(kPeriodMm), pose, everywhere()));
    ASSERT_EQ(frame.status, TrackStatus::tracked) << i;
    EXPECT_EQ(frame.trial, 0);
    expect_pose(frame.trial_T_frame, motion(0, 0, 0, 0, 0, 0.4).inverse() * pose, 2);
  }
}

/// The speed is 30 mm/s. Successive frames are three quarters of a period apart, but the predicted motion
/// determines the right period.
TEST(Tracker, APatternThatMovesFastButSteadilyIsFollowed) {
  Tracker tracker(TrackerOptions{});
  double x_mm = 0;
  for (int i = 0; i < 32; ++i) {
    x_mm += std::min(0.05 * i, 1.2);
    const Pose pose = motion(0, 0, 0, x_mm, 0, 0.4);
    const TrackedFrame frame = tracker.track(i, 0.04 * i, touch(waffle(kPeriodMm), pose, everywhere()));
    ASSERT_EQ(frame.status, TrackStatus::tracked) << i;
    EXPECT_EQ(frame.trial, 0);
    expect_pose(frame.trial_T_frame, motion(0, 0, 0, 0, 0, 0.4).inverse() * pose, 2);
  }
}

/// With constant velocity the sensor would be more than a millimeter farther along the edge, which does not
/// show how far the sensor moved along it.
TEST(Tracker, AnEdgeThatIsShakenIsFoundAgainWhereItRests) {
  Tracker tracker(TrackerOptions{});
  const std::array<double, 7> y_mm = {0, 0.05, -0.05, 0.6, -0.05, 0.6, 0.6};
  int lost = 0;
  for (int i = 0; i < 7; ++i) {
    const double at_mm = y_mm[static_cast<std::size_t>(i)];
    const TrackedFrame frame =
        tracker.track(i, 0.04 * i, touch(extruded_edge(), motion(0, 0, 0, 0, at_mm, 0.4), everywhere()));
    lost += frame.status == TrackStatus::lost;
    if (frame.status == TrackStatus::tracked) {
      EXPECT_NEAR(frame.trial_T_frame.translation().y(), at_mm, kStepMm * (i + 1)) << i;
    }
    if (i == 6) {
      EXPECT_EQ(frame.trial, 0);
    }
  }
  EXPECT_LE(lost, 1);
}

/// The edge runs along the keyframe's x, and after a twist by 72 degrees nearly along the frame's y.
TEST(Tracker, StatesWhatIsNotShownAlongTheAxesOfTheKeyframe) {
  Tracker tracker(TrackerOptions{});
  TrackedFrame frame;
  for (int i = 0; i <= 24; ++i) {
    const Pose pose = motion(0, 0, 3.0 * i, 0, 0, 0.4);
    frame = tracker.track(i, 0.04 * i, touch(extruded_edge(), pose, everywhere()));
    ASSERT_EQ(frame.status, TrackStatus::tracked) << i;
  }
  ASSERT_EQ(frame.keyframe->id, 0);
  const Matrix6d covariance = frame.registration.information.inverse();
  EXPECT_GT(covariance(3, 3), 4 * covariance(4, 4));
}

TEST(Tracker, APatternThatMovedWhenItWasTouchedIsFollowed) {
  constexpr double kStepMm = 0.35;
  Tracker tracker(TrackerOptions{});
  for (int i = 0; i < 8; ++i) {
    const TrackedFrame frame = tracker.track(
        i, 0.04 * i, touch(waffle(kPeriodMm), motion(0, 0, 0, kStepMm * i, 0, 0.4), everywhere()));
    ASSERT_EQ(frame.status, TrackStatus::tracked) << i;
    EXPECT_EQ(frame.trial, 0);
    expect_pose(frame.trial_T_frame, motion(0, 0, 0, kStepMm * i, 0, 0), 2);
  }
}

}  // namespace
}  // namespace gelslam
