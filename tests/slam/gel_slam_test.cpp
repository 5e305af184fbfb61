#include "gelslam/slam/gel_slam.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "gelslam/core/error.hpp"
#include "gelslam/slam/reconstruct.hpp"
#include "strokes.hpp"

namespace gelslam::test {
namespace {

using testing::Each;

/// Expects that every frame with a pose in the map has its true pose relative to the anchor. The error may be
/// a few times that of a single registration (0.03 degrees, 0.01 mm), because errors of registrations add up.
void expect_true_poses(const Strokes& scan, const SlamMap& map) {
  int checked = 0;
  const MapSnapshot placed = snapshot_of(map);
  for (const FrameRecord& frame : map.frames) {
    if (!map.has_pose(frame)) continue;
    const Pose pose = placed.pose_of(frame)->map_T_frame.pose;
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
  scan.stroke(0.8, 0.6, 50);  // the same place with another twist
  const SlamMap map = scan.finish();
  EXPECT_EQ(map.trials, 2);
  EXPECT_EQ(map.components, 1);
  EXPECT_GE(map.loops, 1);
  EXPECT_THAT(map.in_map, Each(true));
  EXPECT_EQ(posed_surfaces(snapshot_of(map)).size(), map.keyframes.size());
  expect_true_poses(scan, map);
}

TEST(GelSlam, TwoPlacesStayTwoComponentsAndTheLargerIsTheMap) {
  Strokes scan;
  scan.stroke(0, 0, 0);
  constexpr std::int64_t kSecondStroke = 3 + kLiftedFrames;
  // The contact is 14 mm wide.
  for (int step = 0; step < 4; ++step) scan.see(stroke_pose(40, 0, 0, step));
  const SlamMap map = scan.finish();
  EXPECT_EQ(map.trials, 2);
  EXPECT_EQ(map.components, 2);
  EXPECT_EQ(map.loops, 0);
  EXPECT_GE(map.anchor_frame, kSecondStroke);  // of the second trial, which has more frames
  for (const FrameRecord& frame : map.frames) EXPECT_EQ(map.has_pose(frame), frame.frame >= kSecondStroke);
  for (const PosedSurface& patch : posed_surfaces(snapshot_of(map))) {
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

// The sensor moves to and fro by less than what requires a new keyframe, and over the same place in a second
// trial.
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

// The path is 6 mm long. Each pass makes new keyframes, and loops join them.
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

/// Returns a surface as it is read by a model whose slopes are too steep by the factor `scale`.
SurfacePtr steeper(const Surface& true_surface, float scale) {
  auto read = std::make_shared<Surface>(true_surface);
  read->height_mm = scale * true_surface.height_mm;
  read->curvature = scale * true_surface.curvature;
  read->normals = true_surface.normals.clone();
  for (cv::Vec3f& n : read->normals) n = cv::normalize(cv::Vec3f(scale * n[0], scale * n[1], n[2]));
  return read;
}

// A ball is rolled by more than a turn, and the model reads slopes 8 % too steep, which the loops reveal. The
// poses of frames must be corrected relative to their keyframes, too. Otherwise rolls from a keyframe to a
// frame would be 8 % too long, up to 1 degree. The last frame before the motion turns back is a patch, which
// has the pose of its frame.
TEST(GelSlam, FramesFollowTheGradientScaleThatTheMapHasFound) {
  constexpr double kRadiusMm = 8, kStepDeg = 4;
  constexpr float kScale = 1.08F;
  const Field ball = bumpy_ellipsoid(1, {kRadiusMm, kRadiusMm, kRadiusMm}, 0.2);
  GelSlam slam{SlamOptions{}};
  StageTimer timer;
  std::vector<Pose> truth;
  const auto see = [&](int step) {
    truth.push_back(motion(0, kStepDeg * step, 0, 0, 0) * pressed(kRadiusMm, 0.8));
    const auto frame = static_cast<std::int64_t>(truth.size()) - 1;
    slam.process(frame, 0.04 * static_cast<double>(frame), steeper(*touch(ball, truth.back()), kScale),
                 timer);
  };
  for (int step = 0; step < 98; ++step) see(step);
  for (int step = 96; step > 89; --step) see(step);
  slam.end_trial(timer);
  const SlamMap map = slam.finish();
  EXPECT_EQ(map.components, 1);
  EXPECT_NEAR(map.gradient_scale().x, kScale, 0.02);
  const MapSnapshot placed = snapshot_of(map);
  double squares = 0, products = 0, farthest_deg = 0;
  for (const FrameRecord& frame : map.frames) {
    ASSERT_TRUE(map.has_pose(frame)) << frame.frame;
    const Pose keyframe_T_frame =
        map.anchor_T_keyframe(frame.keyframe).inverse() * placed.pose_of(frame)->map_T_frame.pose;
    const Pose& of_keyframe = truth[static_cast<std::size_t>(placed.find(frame.keyframe)->frame)];
    const double true_deg =
        so3_log((of_keyframe.inverse() * truth[static_cast<std::size_t>(frame.frame)]).linear()).y() /
        kDegree;
    const double error_deg = so3_log(keyframe_T_frame.linear()).y() / kDegree - true_deg;
    EXPECT_LT(std::abs(error_deg), 0.3) << frame.frame;
    squares += true_deg * true_deg;
    products += error_deg * true_deg;
    farthest_deg = std::max(farthest_deg, std::abs(true_deg));
  }
  EXPECT_GT(farthest_deg, 12);
  EXPECT_NEAR(products / squares, 0, 0.015) << "error per degree from the keyframe";
  int patches = 0;
  for (const auto& keyframe : map.keyframes) {
    const FrameRecord& frame = map.frames[static_cast<std::size_t>(keyframe->frame)];
    if (!keyframe->is_patch) continue;
    ++patches;
    expect_within(gap(placed.pose_of(frame)->map_T_frame.pose, map.anchor_T_keyframe(keyframe->id)), 1e-2,
                  1e-3);
  }
  EXPECT_GT(patches, 0);
}

// A longer session could be written but not read again.
TEST(GelSlam, AScanEndsWhereASessionIsFull) {
  GelSlam slam{SlamOptions{}};
  StageTimer timer;
  EXPECT_EQ(slam.process(kMaxScanFrames - 1, 0, nullptr, timer).status, TrackStatus::background);
  EXPECT_THROW(slam.process(kMaxScanFrames, 0.04, nullptr, timer), Error);
}

}  // namespace
}  // namespace gelslam::test
