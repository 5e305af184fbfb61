#include "gelslam/slam/gel_slam.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "gelslam/slam/reconstruct.hpp"
#include "strokes.hpp"

namespace gelslam::test {
namespace {

using testing::Each;

/// Every frame with a pose in the map lies where the truth has it, seen from the anchor. A pose graph without
/// loop errors passes on what single registrations leave (0.03 degrees, 0.01 mm), a few times over.
void expect_true_poses(const Strokes& scan, const SlamMap& map) {
  int checked = 0;
  for (const FrameRecord& frame : map.frames) {
    if (!map.has_pose(frame)) continue;
    const Pose pose = map.anchor_T_keyframe(frame.keyframe) * frame.keyframe_T_frame;
    const PoseGap error =
        gap(pose, scan.truth().at(map.anchor_frame).inverse() * scan.truth().at(frame.frame));
    EXPECT_LT(error.deg, 0.1) << frame.frame;
    EXPECT_LT(error.mm, 0.04) << frame.frame;
    ++checked;
  }
  EXPECT_GT(checked, 0);
}

TEST(GelSlam, TwoTrialsAtOnePlaceBecomeOneComponent) {
  Strokes scan;
  scan.background(2);
  scan.stroke(0, 0, 0);
  scan.stroke(0.8, 0.6, 50);  // the same place, seen turned
  const SlamMap map = scan.finish();
  EXPECT_EQ(map.trials, 2);
  EXPECT_EQ(map.components, 1);
  EXPECT_GE(map.loops, 1);
  EXPECT_THAT(map.in_map, Each(true));
  EXPECT_EQ(posed_surfaces(map).size(), map.keyframes.size());
  expect_true_poses(scan, map);
}

TEST(GelSlam, TwoPlacesStayTwoComponentsAndTheLargerIsTheMap) {
  Strokes scan;
  scan.stroke(0, 0, 0);
  // The contact is 14 mm wide.
  for (int step = 0; step < 4; ++step) scan.see(stroke_pose(40, 0, 0, step));
  const SlamMap map = scan.finish();
  EXPECT_EQ(map.trials, 2);
  EXPECT_EQ(map.components, 2);
  EXPECT_EQ(map.loops, 0);
  EXPECT_GE(map.anchor_frame, 4);  // of the second trial, which has more frames
  for (const FrameRecord& frame : map.frames) EXPECT_EQ(map.has_pose(frame), frame.frame >= 4);
  for (const PosedSurface& patch : posed_surfaces(map)) {
    EXPECT_EQ(map.keyframes[static_cast<std::size_t>(patch.id)]->trial, 1);
    EXPECT_TRUE(patch.surface == map.keyframes[static_cast<std::size_t>(patch.id)]->surface);
  }
  expect_true_poses(scan, map);
}

TEST(GelSlam, AJumpWithinALogLosesTrackAndFindsBack) {
  Strokes scan({}, View(), textured_plane(1, 0.3));  // so rough that no place looks like another
  const auto jump = [&](const Pose& pose, int new_trial) {
    TrackedFrame frame;
    for (int i = 0; i < 10 && frame.trial != new_trial; ++i) {  // until the patience is over
      frame = scan.see(pose);
      EXPECT_EQ(frame.status, TrackStatus::lost);
    }
    EXPECT_EQ(frame.trial, new_trial);
    return frame.frame;
  };
  for (int step = 0; step < 3; ++step) scan.see(stroke_pose(0, 0, 0, step));
  jump(motion(0, 0, 0, 40, 0, 0.4), 1);
  EXPECT_EQ(scan.see(motion(0, 0, 1, 40.2, 0, 0.4)).status, TrackStatus::tracked);
  const std::int64_t back = jump(motion(0, 0, 20, 0.5, 0.5, 0.4), 2);  // at the first place
  EXPECT_EQ(scan.see(motion(0, 0, 21, 0.6, 0.5, 0.4)).status, TrackStatus::tracked);
  const SlamMap map = scan.finish();
  EXPECT_EQ(map.trials, 3);
  EXPECT_EQ(map.components, 2);
  for (const FrameRecord& frame : map.frames)
    EXPECT_EQ(map.has_pose(frame), frame.frame < 3 || frame.frame > back) << frame.frame;
  for (std::size_t id = 0; id < map.keyframes.size(); ++id)
    EXPECT_EQ(map.keyframes[id]->id, static_cast<int>(id));
  expect_true_poses(scan, map);
}

// To and fro over less than what makes a new keyframe, and over the same place in a second trial.
TEST(GelSlam, APatchHangsAtItsKeyframe) {
  Strokes scan({}, small_view());
  for (int trial = 0; trial < 2; ++trial) {
    for (const double x_mm : {0.0, 0.4, 0.8, 1.2, 1.2, 0.8, 0.4, 0.0, -0.4, -0.8})
      scan.see(motion(0, 0, 0, x_mm, 0, 0.4));
    scan.lift();
  }
  const SlamMap map = scan.finish();
  EXPECT_EQ(map.components, 1);
  int patches = 0;
  for (const auto& keyframe : map.keyframes) {
    if (!keyframe->is_patch) continue;
    ++patches;
    const auto ends_here = [&](const PoseGraphEdge& edge) {
      return edge.from == keyframe->id || edge.to == keyframe->id;
    };
    ASSERT_EQ(std::count_if(map.solved_edges.begin(), map.solved_edges.end(), ends_here), 1);
    EXPECT_FALSE(map.searched[static_cast<std::size_t>(keyframe->id)]);
    const auto& link = *std::find_if(map.solved_edges.begin(), map.solved_edges.end(), ends_here);
    expect_within(gap(map.anchor_T_keyframe(link.from) * link.from_T_to, map.anchor_T_keyframe(link.to)),
                  1e-3, 1e-4);
  }
  EXPECT_GT(patches, 1);
  expect_true_poses(scan, map);
}

// A way of 6 mm. Every pass leaves keyframes of its own, and loops tie them together.
TEST(GelSlam, GoingToAndFroStaysInPlace) {
  Strokes scan({}, small_view());
  for (const bool back : {false, true, false, true, false})
    for (int i = 0; i < 16; ++i) {
      const double x_mm = 0.4 * (back ? 15 - i : i);
      const Pose pose = motion(0, 0, 0.3 * x_mm, x_mm, 0.1 * x_mm, 0.4);
      EXPECT_EQ(scan.see(pose).status, TrackStatus::tracked);
    }
  const SlamMap map = scan.finish();
  EXPECT_EQ(map.components, 1);
  expect_true_poses(scan, map);
}

}  // namespace
}  // namespace gelslam::test
