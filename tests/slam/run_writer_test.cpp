#include "run_folder/run_writer.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "../support/analytic_surface.hpp"
#include "../support/temporary_folder.hpp"

namespace gelslam {
namespace {

using namespace test;
using testing::HasSubstr;
using testing::Not;

/// Four keyframes in a row; of the two loops the rest contradicts the second.
SlamMap map_with_a_false_loop() {
  SlamMap map;
  map.trials = map.components = 1;
  View view;
  view.contact_width_px = view.contact_height_px = 20;
  for (int id = 0; id < 4; ++id) {
    auto keyframe = std::make_shared<Keyframe>();
    keyframe->id = id;
    keyframe->frame = id;
    keyframe->surface = touch(plane(), motion(0, 0, 0, 0, 0, 0), view);
    map.keyframes.push_back(keyframe);
    map.solution.component_T_node[id] = motion(0, 0, 0, id, 0);
    map.solution.component_of_node[id] = 0;
    map.in_map.push_back(true);
    map.frames.push_back({.frame = id, .time_s = 0.04 * id, .keyframe = id});
  }
  const auto add = [&](int from, int to, EdgeKind kind, bool outlier) {
    PoseGraphEdge edge;
    edge.from = from;
    edge.to = to;
    edge.kind = kind;
    map.edges.push_back(edge);
    map.solution.edge_outlier.push_back(outlier);
  };
  for (int id = 0; id < 3; ++id) add(id, id + 1, EdgeKind::odometry, false);
  add(0, 2, EdgeKind::loop, false);
  add(1, 3, EdgeKind::loop, true);
  map.loops = 2;
  return map;
}

TEST(RunFolderFiles, LoopsThatAreContradictedAreNotInTheGraph) {
  const TemporaryFolder folder;
  write_run(folder.path(), Config{}, map_with_a_false_loop(), Mesh{}, RunAccount{});
  const std::string graph = read_bytes(folder / "pose_graph.g2o"),
                    outliers = read_bytes(folder / "loop_outliers.g2o");
  EXPECT_THAT(graph, HasSubstr("EDGE_SE3:QUAT 0 2 "));
  EXPECT_THAT(graph, Not(HasSubstr("EDGE_SE3:QUAT 1 3 ")));
  EXPECT_THAT(outliers, testing::StartsWith("EDGE_SE3:QUAT 1 3 "));
  EXPECT_EQ(std::count(outliers.begin(), outliers.end(), '\n'), 1);
  EXPECT_THAT(run_entries(), testing::Contains("loop_outliers.g2o")) << "else the run cannot be replaced";
}

}  // namespace
}  // namespace gelslam
