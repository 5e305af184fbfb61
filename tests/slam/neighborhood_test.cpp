#include <gtest/gtest.h>

#include <algorithm>

#include "../support/analytic_surface.hpp"
#include "../support/peak_memory.hpp"
#include "gelslam/slam/mapper.hpp"
#include "gelslam/slam/scan_record.hpp"
#include "gelslam/slam/slam_options.hpp"

namespace gelslam {
namespace {

constexpr int kKeyframes = 8;
constexpr double kStepMm = 2.0;  // half of the sensor is five of them

Pose along(double mm) { return Pose(Eigen::Translation3d(mm, 0, 0)); }

PoseGraphEdge edge(int from, int to, double mm, EdgeKind kind) {
  Vector6d diagonal;
  diagonal << Eigen::Vector3d::Constant(1 / (0.004 * 0.004)), Eigen::Vector3d::Constant(1 / (0.03 * 0.03));
  return {from, to, along(mm), diagonal.asDiagonal(), kind};
}

/// A trial in a straight line, and these loops.
ScanRecord straight_trial(const std::vector<PoseGraphEdge>& loops) {
  ScanRecord record;
  for (int id = 0; id < kKeyframes; ++id) {
    record.keyframes.push_back(
        std::make_shared<Keyframe>(Keyframe{id, 10 * id, 0, SurfacePtr(std::make_shared<Surface>()), {}}));
    record.searched.push_back(true);
    if (id > 0) record.edges.push_back(edge(id - 1, id, kStepMm, EdgeKind::odometry));
  }
  record.edges.insert(record.edges.end(), loops.begin(), loops.end());
  return record;
}

std::vector<int> neighbors_of_last(const ScanRecord& record) {
  Mapper mapper{SlamOptions{}};
  mapper.restore(record);
  std::vector<int> ids;
  for (const auto& other : mapper.neighborhood(kKeyframes - 1).others) ids.push_back(other.keyframe->id);
  std::sort(ids.begin(), ids.end());
  return ids;
}

TEST(Neighborhood, EndsBeyondHalfOfTheSensor) {
  EXPECT_EQ(neighbors_of_last(straight_trial({})), (std::vector<int>{2, 3, 4, 5, 6}));
}

/// A surface that repeats itself gives loops that fit each other but contradict odometry. Tracking must not
/// return to where they lead: a keyframe from there would be linked to them by odometry.
TEST(Neighborhood, DoesNotFollowLoopsThatContradictOdometry) {
  const ScanRecord record =
      straight_trial({edge(0, 6, 0.1, EdgeKind::loop), edge(0, 7, kStepMm, EdgeKind::loop)});
  EXPECT_EQ(neighbors_of_last(record), (std::vector<int>{2, 3, 4, 5, 6}));
}

TEST(Neighborhood, FollowsConsistentLoops) {
  ScanRecord record = straight_trial({});
  // Over a hill: odometry alone ends halfway.
  for (PoseGraphEdge& step : record.edges) step.from_T_to.linear() = so3_exp({0, 0.9, 0});
  Pose first_T_last = Pose::Identity();
  for (const PoseGraphEdge& step : record.edges) first_T_last = first_T_last * step.from_T_to;
  PoseGraphEdge loop = edge(0, 7, 0, EdgeKind::loop);
  loop.from_T_to = first_T_last;
  const std::vector<int> before = neighbors_of_last(record);
  record.edges.push_back(loop);
  const std::vector<int> after = neighbors_of_last(record);
  EXPECT_FALSE(std::binary_search(before.begin(), before.end(), 0));
  EXPECT_TRUE(std::binary_search(after.begin(), after.end(), 0));
}

/// What tracking keeps of a map does not grow with the keyframes around one place.
TEST(Neighborhood, AThousandKeyframesAroundOnePlaceTakeLittleMemory) {
  constexpr int kMany = 1000;
  const SurfacePtr surface = test::touch(test::textured_plane(1), test::motion(0, 0, 0, 0, 0, 0.4));
  const std::string bytes = PackedSurface(*surface).bytes();
  ScanRecord record;
  for (int id = 0; id < kMany; ++id) {
    StoredSurface stored(PackedSurface::from_bytes(bytes));
    record.keyframes.push_back(std::make_shared<Keyframe>(
        Keyframe{id, id, 0, stored, StoredReference(stored, NormalFlowOptions{})}));
    record.searched.push_back(true);
    if (id > 0) record.edges.push_back(edge(id - 1, id, id % 2 == 0 ? 0.1 : -0.1, EdgeKind::odometry));
  }
  Mapper mapper{SlamOptions{}};
  mapper.restore(record);
  const Neighborhood around = mapper.neighborhood(kMany / 2);
  EXPECT_GT(around.others.size(), 100U);
  EXPECT_LT(around.others.size(), 300U);
  Tracker tracker(TrackerOptions{});
  tracker.continue_after(kMany / 2 - 1, -1);  // its keyframe is the one in the middle
  ASSERT_EQ(tracker.track(0, 0, surface).keyframe->id, around.center);
  const std::size_t grown = test::memory_growth([&] { tracker.set_neighborhood(around); });
  EXPECT_LT(grown, 80U << 20);  // with the 32 surfaces that were unpacked last
}

}  // namespace
}  // namespace gelslam
