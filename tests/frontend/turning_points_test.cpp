#include "gelslam/frontend/turning_points.hpp"

#include <gtest/gtest.h>

#include "gelslam/frontend/tracker.hpp"
#include "slides.hpp"

namespace gelslam {
namespace {

using namespace test;

/// Returns the pose of the sensor for a contact of 3.8 by 3.2 mm that is shifted by `x_mm` along x.
Pose place(double x_mm) { return motion(0, 0, 0, x_mm, 0, 0.4); }

SurfacePtr at(double x_mm) { return touch(texture(), place(x_mm), small_view()); }

/// The frames of a trial, and the keyframes and patches that the tracker made of them.
struct Tracked {
  explicit Tracked(const TrackerOptions& options) : tracker(options) {}

  TrackedFrame see(double x_mm) {
    x_mm_of.push_back(x_mm);
    return see(at(x_mm));
  }
  TrackedFrame lift() {  // for 0.24 s, until the trial ends
    TrackedFrame frame;
    for (int i = 0; i < kLiftedFrames; ++i) {
      x_mm_of.push_back(0);
      frame = see(nothing());
    }
    return frame;
  }
  TrackedFrame see(SurfacePtr surface) {
    const TrackedFrame frame = tracker.track(next, 0.04 * static_cast<double>(next), std::move(surface));
    ++next;
    for (const NewKeyframe& added : frame.new_keyframes) {
      keyframes.push_back(added.keyframe);
      if (added.keyframe != frame.keyframe) turning_points.push_back(added);
    }
    return frame;
  }
  void go(double from_mm, double to_mm) {
    const double step_mm = from_mm < to_mm ? 0.3 : -0.3;
    for (double x = from_mm; (to_mm - x) / step_mm > 0.01; x += step_mm) see(x);
    see(to_mm);
  }

  Tracker tracker;
  std::int64_t next = 0;
  std::vector<double> x_mm_of;  // of each frame
  std::vector<std::shared_ptr<const Keyframe>> keyframes;
  std::vector<NewKeyframe> turning_points;  // those that no frame refers to
};

TEST(TurningPoints, AMotionThatTurnsBackLeavesTheFrameWhereItDid) {
  Tracked log(TrackerOptions{});
  log.go(0, 1.2);  // a third of the contact is new: no reason for a keyframe yet
  EXPECT_EQ(log.keyframes.size(), 1U);
  TrackedFrame frame;
  for (double x = 0.9; log.turning_points.empty() && x > -3; x -= 0.3) frame = log.see(x);
  ASSERT_EQ(log.turning_points.size(), 1U);
  const auto& [turning_point, edge] = log.turning_points[0];
  EXPECT_EQ(log.x_mm_of[static_cast<std::size_t>(turning_point->frame)], 1.2);
  ASSERT_TRUE(edge) << "it is linked to the keyframe of its time";
  EXPECT_EQ(edge->from, 0);
  EXPECT_EQ(edge->to, turning_point->id);
  EXPECT_EQ(turning_point->trial, 0);
  EXPECT_TRUE(turning_point->is_patch);
  EXPECT_FALSE(frame.keyframe->is_patch);
  EXPECT_TRUE(static_cast<bool>(turning_point->reference));
  expect_within(gap(edge->from_T_to, place(0).inverse() * place(1.2)), 0.03, 0.01);
  EXPECT_EQ(frame.keyframe->id, 0) << "tracking goes on as if nothing had been";
}

TEST(TurningPoints, AMotionThatGoesOnLeavesNone) {
  Tracked log(TrackerOptions{});
  log.go(0, 8);
  log.lift();
  EXPECT_GT(log.keyframes.size(), 3U);
  // The last touches before the sensor is lifted lie beyond the last keyframe. Only they may become patches.
  for (const auto& point : log.turning_points)
    EXPECT_GT(log.x_mm_of[static_cast<std::size_t>(point.keyframe->frame)], 7.0);
}

TEST(TurningPoints, TheSamePlaceIsLeftOnce) {
  Tracked log(TrackerOptions{});
  for (int i = 0; i < 4; ++i) {
    log.go(0, 1.2);
    log.go(0.9, 0);
  }
  EXPECT_EQ(log.turning_points.size(), 1U);
}

TEST(TurningPoints, WhatWasTouchedLastIsKeptWhenTheLogEndsInTouch) {
  Tracked log(TrackerOptions{});
  log.go(0, 1.2);
  const std::vector<NewKeyframe> last = log.tracker.end_trial();
  ASSERT_EQ(last.size(), 1U);
  EXPECT_TRUE(last[0].keyframe->is_patch);
  EXPECT_EQ(log.x_mm_of[static_cast<std::size_t>(last[0].keyframe->frame)], 1.2);
  EXPECT_EQ(last[0].edge.value().from, 0);
  EXPECT_TRUE(log.tracker.end_trial().empty()) << "once";
  EXPECT_EQ(log.see(1.2).trial, 1) << "the object may have moved";
}

TEST(TurningPoints, WhatWasTouchedLastIsKeptWhenContactEnds) {
  Tracked log(TrackerOptions{});
  log.go(0, 1.2);
  EXPECT_TRUE(log.turning_points.empty());
  const TrackedFrame lifted = log.lift();
  EXPECT_EQ(lifted.status, TrackStatus::no_contact);
  ASSERT_EQ(lifted.new_keyframes.size(), 1U);
  EXPECT_EQ(lifted.new_keyframes[0].keyframe->frame, log.next - kLiftedFrames - 1);
  EXPECT_TRUE(log.lift().new_keyframes.empty());
}

// An edge shows sliding across it, but not along it. The pose of such a frame is only known in part, but its
// surface is the same wherever it lies along the edge, so it belongs to the mesh.
TEST(TurningPoints, AFrameWhosePlaceIsOnlyHalfKnownIsKept) {
  const auto slid = [](double y_mm) {
    return touch(extruded_edge(), motion(0, 0, 0, 0, y_mm, 1.5), small_view());
  };
  Tracked log(TrackerOptions{});
  TrackedFrame farthest;
  for (double y = 0; y < 1.25; y += 0.2) farthest = log.see(slid(y));
  ASSERT_EQ(farthest.status, TrackStatus::tracked);
  ASSERT_GT(farthest.trial_T_frame.translation().y(), 0.8);
  log.lift();
  EXPECT_EQ(log.turning_points.size(), 1U);
}

/// Returns the distance along x between a place and the nearest keyframe or patch.
double missed_mm(const Tracked& log, double x_mm) {
  double least = 1e9;
  for (const auto& keyframe : log.keyframes)
    least = std::min(least, std::abs(x_mm - log.x_mm_of[static_cast<std::size_t>(keyframe->frame)]));
  return least;
}

TEST(TurningPoints, AllThatWasTouchedIsInSomeKeyframe) {
  Tracked log(TrackerOptions{});
  double x = 0;
  for (const double to : {1.4, 0.2, 2.9, 1.0, 1.6, -1.3, 0.4, -2.6, 4.1, 2.8}) {
    log.go(x, to);
    x = to;
  }
  log.lift();
  double first = 0, last = 0;
  for (const double at_mm : log.x_mm_of) {
    first = std::min(first, at_mm);
    last = std::max(last, at_mm);
  }
  // A cell of the coarse grid of contact points is 0.5 mm wide, so unseen surface that is narrower may be
  // missed.
  EXPECT_LT(missed_mm(log, first), 0.55);
  EXPECT_LT(missed_mm(log, last), 0.55);
}

TEST(TurningPoints, TheOtherSideOfAThinObjectIsNotSeen) {
  TurningPoints points(0.05);
  const SurfacePtr surface = at(0);
  points.begin_trial({0, surface, Pose::Identity(), {}});
  EXPECT_FALSE(points.pass({1, surface, Pose::Identity(), {}}));
  EXPECT_FALSE(points.end_trial()) << "the same place shows nothing new";
  points.begin_trial({0, surface, Pose::Identity(), {}});
  points.pass({1, surface, motion(0, 0, 0, 0, 0, 2), {}});
  EXPECT_FALSE(points.end_trial()) << "one picture may be damaged";
  points.begin_trial({0, surface, Pose::Identity(), {}});
  points.pass({1, surface, motion(0, 0, 0, 0, 0, 2), {}});
  points.pass({2, surface, motion(0, 0, 0, 0, 0, 2), {}});
  EXPECT_TRUE(points.end_trial()) << "2 mm above is another sheet";
}

}  // namespace
}  // namespace gelslam
