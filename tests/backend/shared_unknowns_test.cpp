#include <gtest/gtest.h>

#include "gelslam/core/error.hpp"
#include "synthetic_graph.hpp"

namespace gelslam {
namespace {

/// A roll of 400 degrees closed by a loop, of which each link measures more than was: the tilt about y times
/// an unknown.
class SharedUnknownsTest : public testing::Test {
 protected:
  SharedUnknownsTest() : graph(roll_of_400_degrees({1.0, 1.0}, true)) {
    shared.information = Eigen::MatrixXd::Constant(1, 1, 100.0);
    for (PoseGraphEdge& edge : graph.edges) {
      Eigen::Matrix<double, 6, Eigen::Dynamic> derivative =
          Eigen::Matrix<double, 6, Eigen::Dynamic>::Zero(6, 1);
      if (edge.kind == EdgeKind::odometry) derivative(1, 0) = so3_log(edge.from_T_to.linear()).y();
      edge.from_T_to = edge.from_T_to * se3_exp(-derivative * kPlanted);
      shared.edge_by_unknown.push_back(derivative);
    }
  }

  static constexpr double kPlanted = 0.05;
  Graph graph;
  SharedUnknowns shared;
};

TEST_F(SharedUnknownsTest, AreFoundWhereALoopClosesAndPosesWithThem) {
  const PoseGraphSolution solution = solve_pose_graph(graph.chained(), graph.edges, {}, shared);
  ASSERT_EQ(solution.shared_unknowns.size(), 1);
  // 90 links of 0.002 rad tell a turn of 6.3 rad to 0.003; the prior (0 +- 0.1) pulls by (0.003 / 0.1)² of
  // 0.05.
  EXPECT_NEAR(solution.shared_unknowns[0], kPlanted, 0.001);
  EXPECT_LT(worst_error(solution.component_T_node, graph.truth).deg, 0.5);
  EXPECT_GT(worst_error(graph.chained(), graph.truth).deg, 5.0);
}

TEST_F(SharedUnknownsTest, StayAtZeroWithoutALoop) {
  graph.edges.pop_back();
  shared.edge_by_unknown.pop_back();
  const PoseGraphSolution solution = solve_pose_graph(graph.chained(), graph.edges, {}, shared);
  EXPECT_NEAR(solution.shared_unknowns[0], 0, 1e-4);
}

TEST_F(SharedUnknownsTest, WhatDoesNotFitIsRefused) {
  const auto solve = [&] { return solve_pose_graph(graph.chained(), graph.edges, {}, shared); };
  const SharedUnknowns good = shared;
  shared.edge_by_unknown.pop_back();
  EXPECT_THROW(solve(), Error);
  shared = good;
  shared.information(0, 0) = -1;
  EXPECT_THROW(solve(), Error);
  shared = good;
  shared.edge_by_unknown[3].resize(6, 5);
  EXPECT_THROW(solve(), Error);
  shared = good;
  shared.edge_by_unknown[3](0, 0) = std::nan("");
  EXPECT_THROW(solve(), Error);
  shared = good;
  shared.information = Eigen::MatrixXd::Identity(3, 3);
  EXPECT_THROW(solve(), Error);
}

}  // namespace
}  // namespace gelslam
