// What the tracker does about motions that no frame before announced: large ones, and those over patterns.

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

/// Two pictures of the object at rest, and one when it was slid along.
TrackedFrame slide_at_once(const Field& field, double slide_mm, bool relocalize = true,
                           double step_s = 0.04) {
  TrackerOptions options;
  options.relocalize = relocalize;
  Tracker tracker(options);
  const SurfacePtr at_rest = touch(field, motion(0, 0, 0, 0, 0, 0.4), everywhere());
  tracker.track(0, 0, at_rest);
  tracker.track(1, 0.04, at_rest);
  return tracker.track(2, 0.04 + step_s, touch(field, motion(0, 0, 0, slide_mm, 0.1, 0.4), everywhere()));
}

TEST(Tracker, AJumpOverAPatternIsLostAndNotGuessed) {
  for (const double slide_mm : {0.6, 1.2, 2.2}) {
    EXPECT_EQ(slide_at_once(waffle(kPeriodMm), slide_mm, false).status, TrackStatus::tracked)
        << "the gates see it";
    const TrackedFrame frame = slide_at_once(waffle(kPeriodMm), slide_mm);
    EXPECT_EQ(frame.status, TrackStatus::lost) << slide_mm;
    EXPECT_EQ(frame.registration.status, RegistrationStatus::ambiguous) << slide_mm;
  }
}

TEST(Tracker, AJumpThatSettlesABumpFurtherIsPutRight) {
  // The second is a whole period: nothing seems to have moved, and only the normals fit badly.
  for (const double slide_mm : {1.2, kPeriodMm}) {
    const TrackedFrame alone = slide_at_once(uneven_waffle(kPeriodMm), slide_mm, false);
    ASSERT_EQ(alone.status, TrackStatus::tracked) << "the gates see it";
    ASSERT_GT(std::abs(alone.trial_T_frame.translation().x() - slide_mm), 1.0);
    const TrackedFrame frame = slide_at_once(uneven_waffle(kPeriodMm), slide_mm);
    ASSERT_EQ(frame.status, TrackStatus::tracked);
    expect_pose(frame.trial_T_frame, motion(0, 0, 0, slide_mm, 0.1), 1);
  }
}

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

/// 30 mm/s: frames are three quarters of a period apart, but the motion tells which period is which.
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

/// At constant velocity it would be more than a millimeter further, and an edge shows no place along itself.
TEST(Tracker, AnEdgeThatIsShakenIsFollowed) {
  Tracker tracker(TrackerOptions{});
  const std::array<double, 6> y_mm = {0, 0.05, -0.05, 0.6, -0.05, 0.6};
  for (int i = 0; i < 6; ++i) {
    const double at_mm = y_mm[static_cast<std::size_t>(i)];
    const TrackedFrame frame =
        tracker.track(i, 0.04 * i, touch(extruded_edge(), motion(0, 0, 0, 0, at_mm, 0.4), everywhere()));
    ASSERT_EQ(frame.status, TrackStatus::tracked) << i;
    EXPECT_EQ(frame.trial, 0);
    EXPECT_NEAR(frame.trial_T_frame.translation().y(), at_mm, kStepMm * (i + 1)) << i;
  }
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

TEST(Tracker, APatternThatMovedWhenItWasTouchedBeginsATrialWithTheSecondFrame) {
  constexpr double kStepMm = 0.35;
  Tracker tracker(TrackerOptions{});
  for (int i = 0; i < 8; ++i) {
    const TrackedFrame frame = tracker.track(
        i, 0.04 * i, touch(waffle(kPeriodMm), motion(0, 0, 0, kStepMm * i, 0, 0.4), everywhere()));
    ASSERT_EQ(frame.status, i == 1 ? TrackStatus::lost : TrackStatus::tracked) << i;
    if (i < 2) continue;
    EXPECT_EQ(frame.trial, 1);
    expect_pose(frame.trial_T_frame, motion(0, 0, 0, kStepMm * (i - 1), 0, 0), 2);
  }
}

TEST(Tracker, AJumpOverAPatternIsNotBelievedBecauseTheObjectRestsThere) {
  Tracker tracker(TrackerOptions{});
  const auto at = [](double x_mm) {
    return touch(waffle(kPeriodMm), motion(0, 0, 0, x_mm, 0, 0.4), everywhere());
  };
  tracker.track(0, 0, at(0));
  EXPECT_EQ(tracker.track(1, 0.04, at(1.1)).status, TrackStatus::lost);
  const TrackedFrame next = tracker.track(2, 0.08, at(1.1));
  EXPECT_EQ(next.status, TrackStatus::tracked);
  EXPECT_EQ(next.trial, 1);
}

TEST(Tracker, AfterALongGapAPatternMayHaveMovedOn) {
  constexpr double kSlideMm = 0.1;
  EXPECT_EQ(slide_at_once(waffle(kPeriodMm), kSlideMm, true, 0.04).status, TrackStatus::tracked);
  EXPECT_EQ(slide_at_once(waffle(kPeriodMm), kSlideMm, true, 0.5).status, TrackStatus::lost);
  EXPECT_EQ(slide_at_once(textured_plane(3), kSlideMm, true, 0.5).status, TrackStatus::tracked);
}

}  // namespace
}  // namespace gelslam
