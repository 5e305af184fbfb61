// Tests the initial poses of a solve: chains of odometry that are not connected are placed by loops.
#include <gtest/gtest.h>

#include <algorithm>

#include "synthetic_graph.hpp"

namespace gelslam {
namespace {

TEST(Placement, ALoopMayPointEitherWayAndJoinInAChain) {
  Graph graph = trials(4, 15, 5);
  graph.join(20, 5, EdgeKind::loop);   // from the later trial to the gauge's
  graph.join(18, 50, EdgeKind::loop);  // trial 3 is linked to trial 1
  graph.join(50, 40, EdgeKind::loop);  // trial 2 is linked to trial 3
  const PoseGraphSolution solution = solve_pose_graph(graph.chained(), graph.edges, {});
  EXPECT_EQ(solution.component_of_node.at(59), 0);
  EXPECT_LT(worst_error(solution.component_T_node, graph.truth).deg, 1e-4);
  EXPECT_LT(worst_error(solution.component_T_node, graph.truth).mm, 1e-4);
}

TEST(Placement, AFalseLoopThatComesFirstDoesNotDecide) {
  Graph graph = trials(2, 15, 5);
  graph.join(2, 16, EdgeKind::loop, away(0.4, -0.8, 1.5, 4, -3, 1));
  graph.join(10, 20, EdgeKind::loop);
  graph.join(12, 22, EdgeKind::loop);
  const PoseGraphSolution solution = solve_pose_graph(graph.chained(), graph.edges, {});
  EXPECT_LT(worst_error(solution.component_T_node, graph.truth).deg, 0.05);
  EXPECT_TRUE(solution.edge_outlier[graph.edges.size() - 3]);
  EXPECT_FALSE(solution.edge_outlier.back());
}

// If the last solution still agrees with the edges, it is the initial value of the next solve, which then
// moves nothing and takes few iterations.
TEST(Placement, AWarmStartIsKept) {
  Graph graph = trials(3, 15, 5);
  for (int i = 0; i < 30; i += 2) graph.join_noisily(i, i + 15, EdgeKind::loop);
  const PoseGraphSolution cold = solve_pose_graph(graph.chained(), graph.edges, {});
  const PoseGraphSolution warm = solve_pose_graph(cold.component_T_node, graph.edges, {});
  EXPECT_NEAR(warm.final_cost, cold.final_cost, 1e-6 * cold.final_cost);
  EXPECT_LE(warm.iterations, 3);
}

// The first loop to a chain of odometry is an outlier. The chain must stay at the place that the other loops
// determine.
TEST(Placement, AWarmStartIsKeptWhenTheFirstLoopDoesNotFit) {
  Graph graph = trials(2, 15, 5);
  graph.join(2, 17, EdgeKind::loop, away(0, 0, 0, 0.5, 0, 0));
  for (int i = 5; i < 15; ++i) graph.join_noisily(i, i + 10, EdgeKind::loop);
  const PoseGraphSolution cold = solve_pose_graph(graph.chained(), graph.edges, {});
  ASSERT_EQ(std::count(cold.edge_outlier.begin(), cold.edge_outlier.end(), true), 1);
  const PoseGraphSolution warm = solve_pose_graph(cold.component_T_node, graph.edges, {});
  EXPECT_NEAR(warm.final_cost, cold.final_cost, 1e-6 * cold.final_cost);
  EXPECT_LT(worst_error(warm.component_T_node, cold.component_T_node).deg, 0.01);
}

}  // namespace
}  // namespace gelslam
