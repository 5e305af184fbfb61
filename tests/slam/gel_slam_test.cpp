#include "gelslam/slam/gel_slam.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "../support/analytic_surface.hpp"
#include "gelslam/slam/reconstruct.hpp"

namespace gelslam {
namespace {

using namespace test;
using testing::Each;
using testing::ElementsAre;

const Field& texture() {
  static const Field field = textured_plane(1);
  return field;
}

SurfacePtr nothing() {
  static const SurfacePtr surface = touch(texture(), motion(0, 0, 0, 0, 0, -3));
  return surface;
}

/// Feeds a log: each entry is where the sensor is over the texture, or nothing where it is lifted.
class Scan {
 public:
  explicit Scan(const SlamOptions& options = {}, const View& view = {}) : slam_(options), view_(view) {}

  void background(int count) {
    for (int i = 0; i < count; ++i) slam_.process(next_++, 0, nullptr, timer_);
  }
  TrackedFrame see(const Pose& texture_T_sensor) {
    const std::int64_t frame = next_++;
    truth_[frame] = texture_T_sensor;
    return slam_.process(frame, 0.04 * static_cast<double>(frame), touch(texture(), texture_T_sensor, view_),
                         timer_);
  }
  TrackedFrame lift() {
    const std::int64_t frame = next_++;
    return slam_.process(frame, 0.04 * static_cast<double>(frame), nothing(), timer_);
  }
  SlamMap finish(ProgressSink* progress = nullptr) const { return slam_.finish(true, progress); }
  Pose true_motion(std::int64_t from, std::int64_t to) const {
    return truth_.at(from).inverse() * truth_.at(to);
  }
  const Pose& truth(std::int64_t frame) const { return truth_.at(frame); }

 private:
  GelSlam slam_;
  View view_;
  StageTimer timer_;
  std::int64_t next_ = 0;
  std::map<std::int64_t, Pose> truth_;
};

/// A stroke of a few frames from (x, y).
void stroke(Scan& scan, double x_mm, double y_mm, double twist_deg) {
  for (int i = 0; i < 3; ++i) scan.see(motion(0.5 * i, 0, twist_deg, x_mm + 0.3 * i, y_mm - 0.2 * i, 0.4));
}

/// Every frame with a pose in the map lies where the truth has it, seen from the anchor. A pose graph without
/// loop errors passes on what single registrations leave (0.03 degrees, 0.01 mm), a few times over.
void expect_true_poses(const Scan& scan, const SlamMap& map) {
  int checked = 0;
  for (const FrameRecord& frame : map.frames) {
    if (!map.has_pose(frame)) continue;
    const Pose pose = map.anchor_T_keyframe(frame.keyframe) * frame.keyframe_T_frame;
    const PoseGap error = gap(pose, scan.true_motion(map.anchor_frame, frame.frame));
    EXPECT_LT(error.deg, 0.1) << frame.frame;
    EXPECT_LT(error.mm, 0.04) << frame.frame;
    ++checked;
  }
  EXPECT_GT(checked, 0);
}

TEST(GelSlam, TwoTrialsAtOnePlaceBecomeOneComponent) {
  Scan scan;
  scan.background(2);
  stroke(scan, 0, 0, 0);
  scan.lift();
  stroke(scan, 0.8, 0.6, 50);  // the same place, seen turned
  const SlamMap map = scan.finish();
  EXPECT_EQ(map.trials, 2);
  EXPECT_EQ(map.components, 1);
  EXPECT_GE(map.loops, 1);
  EXPECT_THAT(map.in_map, Each(true));
  EXPECT_EQ(posed_surfaces(map).size(), map.keyframes.size());
  expect_true_poses(scan, map);
}

TEST(GelSlam, TwoPlacesStayTwoComponentsAndTheLargerIsTheMap) {
  Scan scan;
  stroke(scan, 0, 0, 0);
  scan.lift();
  stroke(scan, 40, 0, 0);  // the contact is 14 mm wide
  scan.see(motion(0, 0, 2, 40.8, -0.5, 0.4));
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
  Scan scan;
  stroke(scan, 0, 0, 0);
  EXPECT_EQ(scan.see(motion(0, 0, 0, 40, 0, 0.4)).status, TrackStatus::lost);
  EXPECT_EQ(scan.see(motion(0, 0, 1, 40.2, 0, 0.4)).status, TrackStatus::tracked);
  EXPECT_EQ(scan.see(motion(0, 0, 20, 0.5, 0.5, 0.4)).status, TrackStatus::lost);  // back at the first place
  EXPECT_EQ(scan.see(motion(0, 0, 21, 0.6, 0.5, 0.4)).status, TrackStatus::tracked);
  const SlamMap map = scan.finish();
  EXPECT_EQ(map.trials, 3);
  EXPECT_EQ(map.components, 2);
  ASSERT_EQ(map.frames.size(), 7u);
  EXPECT_TRUE(map.has_pose(map.frames[0]));
  EXPECT_FALSE(map.has_pose(map.frames[3]));
  EXPECT_FALSE(map.has_pose(map.frames[5]));  // only the next one told that it was no torn picture
  EXPECT_TRUE(map.has_pose(map.frames[6]));
  for (std::size_t id = 0; id < map.keyframes.size(); ++id)
    EXPECT_EQ(map.keyframes[id]->id, static_cast<int>(id));
  expect_true_poses(scan, map);
}

// Lifting leaves a fragment too small to be recognized, and the tracker loses it. Where it must be is known:
// it was there a frame ago.
TEST(GelSlam, AFragmentLeftByLiftingIsRejoined) {
  const Field stone = bumpy_ellipsoid(3);
  GelSlam slam(SlamOptions{});
  StageTimer timer;
  const Pose places[] = {pressed(6, 0.5), pressed(6, 0.5) * motion(0.5, 0.3, 0, 0.1, 0), pressed(6, 0.065),
                         pressed(6, 0.06)};
  std::vector<TrackStatus> status;
  for (std::size_t i = 0; i < 4; ++i)
    status.push_back(slam.process(static_cast<std::int64_t>(i), 0, touch(stone, places[i]), timer).status);
  EXPECT_THAT(status, ElementsAre(TrackStatus::tracked, TrackStatus::tracked, TrackStatus::lost,
                                  TrackStatus::tracked));
  const SlamMap map = slam.finish();
  EXPECT_EQ(map.trials, 2);
  EXPECT_EQ(map.components, 1);
  EXPECT_EQ(map.loops, 1);
  ASSERT_EQ(map.anchor_frame, 0);
  const PoseGap error = gap(map.anchor_T_keyframe(map.frames[3].keyframe),
                            places[0].inverse() * places[2]);  // keyframe: of the frame before
  EXPECT_LT(error.deg, 1.0);  // a fragment of two millimeters knows less than a whole contact
  EXPECT_LT(error.mm, 0.1);
}

/// A contact of 3.8 by 3.2 mm, which a short way outgrows.
View small_contact() {
  View view;
  view.contact_width_px = 60;
  view.contact_height_px = 50;
  return view;
}

/// Sensor poses along a way of 6 mm.
std::vector<Pose> way(bool back) {
  std::vector<Pose> poses;
  for (int i = 0; i < 16; ++i) {
    const double x_mm = 0.4 * (back ? 15 - i : i);
    poses.push_back(motion(0, 0, 0.3 * x_mm, x_mm, 0.1 * x_mm, 0.4));
  }
  return poses;
}

// Every pass leaves keyframes of its own, and loops tie them together.
TEST(GelSlam, GoingToAndFroStaysInPlace) {
  Scan scan({}, small_contact());
  for (const bool back : {false, true, false, true, false})
    for (const Pose& pose : way(back)) EXPECT_EQ(scan.see(pose).status, TrackStatus::tracked);
  const SlamMap map = scan.finish();
  EXPECT_EQ(map.components, 1);
  expect_true_poses(scan, map);
}

}  // namespace
}  // namespace gelslam
