#include "gelslam/frontend/tracker.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <opencv2/core.hpp>

#include "gelslam/surface/contact_overlap.hpp"
#include "slides.hpp"

namespace gelslam {
namespace {

using namespace test;

TEST(Tracker, ATrialGoesOnWithAQuarterOfTheContactThatBeginsOne) {
  const SurfacePtr whole = slide(0);
  const auto with_rows = [&](int rows) {
    auto part = std::make_shared<Surface>(*whole);
    part->contact = whole->contact.clone();
    part->contact.rowRange(rows, part->contact.rows).setTo(0);
    part->contact_pixels = cv::countNonZero(part->contact);
    return SurfacePtr(part);
  };
  int rows = 1;  // the number of rows that contain at least 0.3 of the contact
  while (with_rows(rows)->contact_pixels < 0.3 * whole->contact_pixels) ++rows;
  const SurfacePtr small = with_rows(rows);
  int fewer = rows;  // the number of rows that contain less than 0.25 of it
  while (with_rows(fewer)->contact_pixels >= 0.25 * whole->contact_pixels) --fewer;

  TrackerOptions options;
  options.min_contact_mm2 = whole->contact_mm2();
  EXPECT_EQ(Tracker(options).track(0, 0, small).status, TrackStatus::no_contact);
  Tracker tracker(options);
  EXPECT_EQ(tracker.track(0, 0, whole).status, TrackStatus::tracked);
  const TrackedFrame frame = tracker.track(1, 0.04, small);
  EXPECT_EQ(frame.status, TrackStatus::tracked);
  EXPECT_EQ(frame.trial, 0);
  EXPECT_LT(frame.trial_T_frame.translation().norm(), 0.02);
  EXPECT_EQ(tracker.track(2, 0.08, with_rows(fewer)).status, TrackStatus::no_contact);
}

TEST(Tracker, FirstContactStartsATrialWithAKeyframe) {
  Tracker tracker(TrackerOptions{});
  tracker.track(0, 0, nothing());
  const SurfacePtr surface = slide(0);
  const TrackedFrame frame = tracker.track(1, 0.04, surface);
  EXPECT_EQ(frame.status, TrackStatus::tracked);
  EXPECT_EQ(frame.trial, 0);
  EXPECT_TRUE(frame.trial_T_frame.isApprox(Pose::Identity()));
  EXPECT_TRUE(frame.keyframe_T_frame.isApprox(Pose::Identity()));
  ASSERT_THAT(frame.new_keyframes, testing::SizeIs(1));
  EXPECT_EQ(frame.keyframe, frame.new_keyframes.back().keyframe);
  EXPECT_EQ(frame.new_keyframes.back().keyframe->id, 0);
  EXPECT_EQ(frame.new_keyframes.back().keyframe->frame, 1);
  EXPECT_EQ(frame.new_keyframes.back().keyframe->trial, 0);
  EXPECT_TRUE(frame.new_keyframes.back().keyframe->surface.packed().bytes() ==
              PackedSurface(*surface).bytes());
  EXPECT_TRUE(static_cast<bool>(frame.new_keyframes.back().keyframe->reference));
  EXPECT_FALSE(frame.new_keyframes.back().edge);
  EXPECT_THAT(frame.registration.observable, testing::Each(true));
}

TEST(Tracker, FramesHangOnTheKeyframeWhileTheyShareEnough) {
  Tracker tracker(TrackerOptions{});
  const auto keyframe = tracker.track(0, 0, slide(0)).keyframe;
  for (int i = 1; i < 5; ++i) {
    const TrackedFrame frame = tracker.track(i, 0.04 * i, slide(i));
    ASSERT_EQ(frame.status, TrackStatus::tracked);
    EXPECT_EQ(frame.trial, 0);
    EXPECT_EQ(frame.keyframe, keyframe);
    EXPECT_THAT(frame.new_keyframes, testing::IsEmpty());
    expect_pose(frame.trial_T_frame, true_motion(0, i), 1);
    expect_pose(frame.keyframe_T_frame, true_motion(0, i), 1);
  }
}

TEST(Tracker, AnOutgrownKeyframeIsReplacedAndPosesGoOn) {
  const TrackerOptions options;
  Tracker tracker(options);
  std::shared_ptr<const Keyframe> current = tracker.track(0, 0, slide(0)).keyframe;
  int switches = 0;
  for (int i = 1; i < 26; ++i) {
    const TrackedFrame frame = tracker.track(i, 0.04 * i, slide(i));
    ASSERT_EQ(frame.status, TrackStatus::tracked) << i;
    expect_pose(frame.trial_T_frame, true_motion(0, i), switches + 1);
    ASSERT_NE(frame.keyframe, nullptr);
    expect_pose(frame.keyframe_T_frame, true_motion(static_cast<int>(frame.keyframe->frame), i), 1);
    const int before = static_cast<int>(current->frame);
    const double shared =
        shown_share(coarse_contact_points_mm(*slide(i)), *slide(before), true_motion(before, i));
    const double less = options.keyframe_min_shared - shared;
    EXPECT_TRUE(std::abs(less) < 0.02 || (less > 0) == !frame.new_keyframes.empty()) << i << ": " << shared;
    if (frame.new_keyframes.empty()) continue;
    ++switches;
    EXPECT_EQ(frame.new_keyframes.back().keyframe->id, switches);
    EXPECT_EQ(frame.new_keyframes.back().keyframe->frame,
              i);  // early: this very frame, before tracking needs it
    EXPECT_EQ(frame.keyframe, frame.new_keyframes.back().keyframe);
    const PoseGraphEdge& edge = frame.new_keyframes.back().edge.value();
    ASSERT_EQ(edge.from, current->id);
    expect_pose(edge.from_T_to, true_motion(static_cast<int>(current->frame), i), 1);
    EXPECT_GT(edge.information.topLeftCorner(5, 5).determinant(), 0);
    current = frame.new_keyframes.back().keyframe;
  }
  EXPECT_GE(switches, 2) << "10 mm of slide over a contact of 7.6 mm";
}

TEST(Tracker, WhenTheKeyframeIsLostThePreviousFrameBecomesOne) {
  TrackerOptions options;
  options.keyframe_min_shared = 0;  // no early keyframes: tracking goes on until it breaks
  Tracker tracker(options);
  const auto first = tracker.track(0, 0, slide(0)).keyframe;
  for (int i = 1; i < 26; ++i) {
    const TrackedFrame frame = tracker.track(i, 0.04 * i, slide(i));
    ASSERT_EQ(frame.status, TrackStatus::tracked) << i;
    expect_pose(frame.trial_T_frame, true_motion(0, i), 2);
    if (frame.new_keyframes.empty()) continue;
    EXPECT_EQ(frame.trial, 0);
    EXPECT_EQ(frame.new_keyframes.back().keyframe->frame, i - 1);
    EXPECT_EQ(frame.new_keyframes.back().keyframe->id, 1);
    EXPECT_EQ(frame.keyframe, frame.new_keyframes.back().keyframe);
    EXPECT_EQ(frame.new_keyframes.back().edge.value().from, first->id);
    expect_pose(frame.new_keyframes.back().edge->from_T_to, true_motion(0, i - 1), 1);
    expect_pose(frame.keyframe_T_frame, true_motion(i - 1, i), 1);
    return;
  }
  FAIL() << "10 mm of slide over a contact of 7.6 mm never needed a second keyframe";
}

/// Tests a jump to another place whose surface has nothing in common. `before` frames are tracked first. With
/// one, the last tracked frame is the keyframe itself, so no second registration is possible; with more, it
/// fails, too.
void expect_loss_after(int before) {
  TrackerOptions options;
  options.patience_s = 0;
  Tracker tracker(options);
  for (int i = 0; i < before; ++i) tracker.track(i, 0.04 * i, slide(i));
  const SurfacePtr elsewhere = slide(0, other_texture());
  const TrackedFrame lost = tracker.track(before, 0.04 * before, elsewhere);
  EXPECT_EQ(lost.status, TrackStatus::lost);
  EXPECT_FALSE(lost.registration.ok());
  EXPECT_EQ(lost.trial, 1);
  EXPECT_TRUE(lost.trial_T_frame.isApprox(Pose::Identity()));
  ASSERT_EQ(lost.new_keyframes.size(), before > 1 ? 2U : 1U)
      << "what the trial has shown last, beyond its keyframe";
  EXPECT_TRUE(lost.new_keyframes.back().keyframe->surface.packed().bytes() ==
              PackedSurface(*elsewhere).bytes());
  EXPECT_EQ(lost.new_keyframes.back().keyframe->trial, 1);
  EXPECT_EQ(lost.new_keyframes.back().keyframe->id, before > 1 ? 2 : 1)
      << "every keyframe that is made is handed out, and ids have no gaps";
  EXPECT_FALSE(lost.new_keyframes.back().edge);

  const TrackedFrame next = tracker.track(before + 1, 0.04 * (before + 1), slide(1, other_texture()));
  EXPECT_EQ(next.status, TrackStatus::tracked);
  EXPECT_EQ(next.trial, 1);
  EXPECT_EQ(next.keyframe, lost.new_keyframes.back().keyframe);
  expect_pose(next.trial_T_frame, true_motion(0, 1), 1);
}

TEST(Tracker, WithoutPatienceAJumpStartsANewTrial) { expect_loss_after(1); }
TEST(Tracker, WithoutPatienceAJumpAfterSomeFramesStartsANewTrial) { expect_loss_after(4); }

void expect_lost_without_a_trial(const TrackedFrame& frame) {
  EXPECT_EQ(frame.status, TrackStatus::lost);
  EXPECT_FALSE(frame.registration.ok());
  EXPECT_EQ(frame.trial, -1);
  EXPECT_EQ(frame.keyframe, nullptr);
  EXPECT_THAT(frame.new_keyframes, testing::IsEmpty());
}

TEST(Tracker, ATrialOutlastsTornPictures) {
  Tracker tracker(TrackerOptions{});
  const auto seen = [](int i) { return touch(texture(), on_the_way(i), everywhere()); };
  for (int i = 0; i < 4; ++i) tracker.track(i, 0.04 * i, seen(i));
  // Three successive frames agree with each other, but not with the frames before.
  for (int i = 4; i < 7; ++i)
    expect_lost_without_a_trial(tracker.track(i, 0.04 * i, slide(0, other_texture())));
  for (int i = 7; i < 12; ++i) {
    const TrackedFrame frame = tracker.track(i, 0.04 * i, seen(i));
    ASSERT_EQ(frame.status, TrackStatus::tracked) << i;
    EXPECT_EQ(frame.trial, 0);
    expect_pose(frame.trial_T_frame, true_motion(0, i), 2);
  }
}

TEST(Tracker, PatienceEndsAndATrialBeginsWithWhateverComes) {
  Tracker tracker(TrackerOptions{});
  tracker.track(0, 0, slide(0));
  expect_lost_without_a_trial(tracker.track(1, 0.04, slide(0, textured_plane(101))));
  const TrackedFrame late = tracker.track(2, 0.30, slide(0, textured_plane(102)));
  EXPECT_EQ(late.status, TrackStatus::lost);
  EXPECT_EQ(late.trial, 1);
  ASSERT_THAT(late.new_keyframes, testing::SizeIs(1));
  EXPECT_EQ(late.new_keyframes.back().keyframe->frame, 2);
}

TEST(Tracker, LiftingEndsATrialAndTouchingAgainStartsTheNext) {
  Tracker tracker(TrackerOptions{});
  tracker.track(0, 0.00, slide(0));
  EXPECT_EQ(tracker.track(1, 0.04, slide(1)).trial, 0);
  // What one picture alone shows may be damage.
  for (int frame = 2; frame < 4; ++frame) tracker.track(frame, 0.04 * frame, slide(1));
  const TrackedFrame lifted = tracker.track(4, 0.16, nothing());
  EXPECT_EQ(lifted.status, TrackStatus::no_contact);
  EXPECT_EQ(lifted.trial, -1);
  EXPECT_EQ(lifted.keyframe, nullptr);
  tracker.track(5, 0.36, nothing());
  const TrackedFrame again = tracker.track(6, 0.40, slide(3));
  EXPECT_EQ(again.status, TrackStatus::tracked);
  EXPECT_EQ(again.trial, 1);
  EXPECT_TRUE(again.trial_T_frame.isApprox(Pose::Identity()));
  ASSERT_THAT(again.new_keyframes, testing::Not(testing::IsEmpty()));
  EXPECT_EQ(again.new_keyframes.back().keyframe->id, 2) << "after the last touch of the trial before";
  EXPECT_FALSE(again.new_keyframes.back().edge);
  const TrackedFrame next = tracker.track(7, 0.44, slide(4));
  EXPECT_EQ(next.trial, 1);
  expect_pose(next.trial_T_frame, true_motion(3, 4), 1);  // relative to the first frame of the new trial
}

TEST(Tracker, ATrialOutlastsAnInterruptedContact) {
  Tracker tracker(TrackerOptions{});
  for (int i = 0; i < 3; ++i) tracker.track(i, 0.04 * i, slide(i));
  for (int i = 3; i < 6; ++i)
    EXPECT_EQ(tracker.track(i, 0.04 * i, nothing()).status, TrackStatus::no_contact) << i;
  const TrackedFrame again = tracker.track(6, 0.24, slide(3));
  EXPECT_EQ(again.status, TrackStatus::tracked);
  EXPECT_EQ(again.trial, 0);
  expect_pose(again.trial_T_frame, true_motion(0, 3), 1);
}

TEST(Tracker, AnotherObjectAfterAnInterruptionIsNotTakenForTheFirst) {
  Tracker tracker(TrackerOptions{});
  for (int i = 0; i < 3; ++i) tracker.track(i, 0.04 * i, slide(i));
  tracker.track(3, 0.12, nothing());
  for (int i = 4; i < 8; ++i)
    expect_lost_without_a_trial(tracker.track(i, 0.04 * i, slide(0, other_texture())));
  EXPECT_EQ(tracker.track(8, 0.32, slide(0, other_texture())).trial, 1);
}

/// Returns a registration method that always returns the pose of the prior. It counts the prepared
/// references.
Registrar standing_still(int& prepared) {
  return [&prepared](SurfacePtr surface) {
    ++prepared;
    const auto samples = std::make_shared<const NormalFlowReference>(surface, NormalFlowOptions{});
    return PreparedReference{samples, [samples](const Surface& target, const PosePrior& prior) {
                               return judge_pose(*samples, target, prior.pose, {});
                             }};
  };
}

TEST(Tracker, TakesAnotherMethod) {
  int prepared = 0;
  TrackerOptions options;
  options.patience_s = 0;
  Tracker tracker(options, standing_still(prepared));
  const auto keyframe = tracker.track(0, 0, slide(0)).keyframe;
  EXPECT_EQ(prepared, 1);
  ASSERT_TRUE(static_cast<bool>(keyframe->reference)) << "loop closure goes on with it, whatever tracks";
  const TrackedFrame same = tracker.track(1, 0.04, slide(0));
  EXPECT_EQ(same.status, TrackStatus::tracked);
  const TrackedFrame elsewhere = tracker.track(2, 0.08, slide(10));  // where standing still is wrong
  EXPECT_EQ(elsewhere.status, TrackStatus::lost);
  EXPECT_EQ(prepared, 3) << "the previous frame was tried, then this one began a trial";
}

}  // namespace
}  // namespace gelslam
