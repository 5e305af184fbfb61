// Scans of a surface that repeats itself. Place recognition finds false loops, and the map must be right
// nevertheless.
#include <gtest/gtest.h>

#include "../support/analytic_surface.hpp"
#include "gelslam/loop_closure/loop_closer.hpp"
#include "gelslam/slam/gel_slam.hpp"

namespace gelslam::test {
namespace {

constexpr double kPeriodMm =
    10.0;  // more than half of the contact's width, so that no single frame is self-similar

/// Returns an infinite texture that repeats every kPeriodMm along x.
Field repeating_plane() {
  Waves waves = random_waves(1, 0.15, 1.0, 3.0, true);
  const double step = 2 * M_PI / kPeriodMm;
  for (Waves::Wave& wave : waves.waves) wave.k.x() = step * std::round(wave.k.x() / step);
  return relief(waves);
}

struct Stroke {
  SlamMap map;
  std::vector<Pose> truth;  // by frame
};

/// Returns a scan that moves twice over the same path.
Stroke two_strokes(double length_mm) {
  const Field texture = repeating_plane();
  GelSlam slam(SlamOptions{});
  StageTimer timer;
  Stroke result;
  const auto see = [&](const Pose& pose) {
    const auto frame = static_cast<std::int64_t>(result.truth.size());
    result.truth.push_back(pose);
    slam.process(frame, 0.04 * static_cast<double>(frame), touch(texture, pose), timer);
  };
  for (const double y : {0.0, 0.4}) {
    for (double x = 0; x < length_mm; x += 0.8) see(motion(0, 0.1 * x, 0.3 * x, x, y + 0.05 * x, 0.4));
    for (int i = 0; i < 6; ++i) see(motion(0, 0, 0, length_mm, 0, -3));  // lifted until the trial ends
  }
  result.map = slam.finish();
  return result;
}

Pose true_motion(const Stroke& stroke, int from, int to) {
  const auto pose = [&](int id) {
    return stroke.truth[static_cast<std::size_t>(stroke.map.keyframes[static_cast<std::size_t>(id)]->frame)];
  };
  return pose(from).inverse() * pose(to);
}

// Returns the number of loops that are wrong by more than half a period, which is far more than errors of
// registration.
template <typename Loops>
int wrong_loops(const Stroke& stroke, const Loops& loops) {
  return static_cast<int>(std::count_if(loops.begin(), loops.end(), [&](const auto& loop) {
    return gap(loop.from_T_to, true_motion(stroke, loop.from, loop.to)).mm > kPeriodMm / 2;
  }));
}

TEST(FalseLoops, ARepeatedPatternDoesNotBendTheMap) {
  const Stroke scan = two_strokes(26);
  LoopCloser closer{LoopClosureOptions{}};
  std::vector<PoseGraphEdge> recognized;
  for (const auto& keyframe : scan.map.keyframes)
    for (const PoseGraphEdge& loop : closer.add(*keyframe)) recognized.push_back(loop);
  ASSERT_GE(wrong_loops(scan, recognized), 3);  // or there is nothing to withstand

  EXPECT_EQ(scan.map.components, 1);
  EXPECT_EQ(wrong_loops(scan, scan.map.solved_edges), 0);
  for (std::size_t id = 0; id < scan.map.keyframes.size(); ++id) {
    const Pose pose = scan.map.solution.component_T_node.at(static_cast<int>(id));
    const PoseGap error = gap(pose, true_motion(scan, 0, static_cast<int>(id)));
    EXPECT_LT(error.deg, 0.2)
        << id;  // single registrations have 0.03 degrees and 0.01 mm, a few of them in a row
    EXPECT_LT(error.mm, 0.1) << id;
  }
}

}  // namespace
}  // namespace gelslam::test
