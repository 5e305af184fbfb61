// Tests that false loops are rejected: loops that contradict odometry, false loops that agree with each
// other, and many false loops at once.
#include <gtest/gtest.h>

#include <algorithm>
#include <limits>
#include <set>

#include "gelslam/backend/pose_graph.hpp"
#include "gelslam/core/error.hpp"
#include "synthetic_graph.hpp"

namespace gelslam {
namespace {

constexpr double kScaleSigma = 0.1;

/// The flags of the loops.
std::vector<bool> flags(const Graph& graph) {
  const std::vector<bool> all = consistent_edges(graph.edges, kScaleSigma);
  EXPECT_EQ(all.size(), graph.edges.size());
  std::vector<bool> of_loops;
  for (std::size_t i = 0; i < graph.edges.size(); ++i) {
    if (graph.edges[i].kind == EdgeKind::loop)
      of_loops.push_back(all[i]);
    else
      EXPECT_TRUE(all[i]) << i;
  }
  return of_loops;
}

std::ptrdiff_t accepted(const std::vector<bool>& flags) {
  return std::count(flags.begin(), flags.end(), true);
}

TEST(LoopConsistency, TrueLoopsAreKept) {
  Graph graph = trials(1, 100, 4, 1);
  for (int i = 0; i + 90 < 100; ++i) graph.join_noisily(i, i + 90, EdgeKind::loop);
  for (int i = 0; i + 3 < 100; i += 5) graph.join_noisily(i, i + 3, EdgeKind::loop);
  EXPECT_EQ(accepted(flags(graph)), 30);
}

// If slopes are read 8 % too steep, a turn of 360 degrees is measured 29 degrees too long. This is far beyond
// the noise, but must not count as a contradiction, because the gradient scale is unknown.
TEST(LoopConsistency, AGradientScaleIsNoContradiction) {
  const Graph graph = roll_of_400_degrees({1.08, 1.08}, true);
  const std::vector<bool> keep = flags(graph);
  EXPECT_TRUE(keep.back());
  EXPECT_FALSE(consistent_edges(graph.edges, 0.0).back());
}

TEST(LoopConsistency, WhatOdometryContradictsIsLeftOut) {
  Graph graph = trials(1, 40, 4, 2);
  graph.join(3, 8, EdgeKind::loop, away(0, 0, 0, 1.2, 0, 0));  // a neighboring bump of a knurl
  graph.join(0, 39, EdgeKind::loop);
  graph.join(5, 30, EdgeKind::loop, away(0, 0, M_PI, 0, 0, 0));
  EXPECT_EQ(flags(graph), (std::vector<bool>{false, true, false}));
}

// A hundred false loops are wrong by the same shift, and ten are true. Odometry decides, and not the larger
// number.
TEST(LoopConsistency, ManyThatAgreeByAShiftDoNotOutvoteOdometry) {
  Graph graph = trials(1, 110, 1, 3);
  for (int i = 0; i < 100; ++i) graph.join_noisily(i, i + 8, EdgeKind::loop, away(0, 0, 0, 0, 1.5, 0));
  for (int i = 0; i < 10; ++i) graph.join_noisily(i, i + 100, EdgeKind::loop);
  const std::vector<bool> keep = flags(graph);
  EXPECT_EQ(accepted({keep.begin(), keep.begin() + 100}), 0);
  EXPECT_EQ(accepted({keep.begin() + 100, keep.end()}), 10);
}

// A chain of thirty odometry edges, each with a standard deviation of 0.2 mm along x, does not contradict an
// error of 4 mm. The true loops beside the false one contradict it in the solution of the graph.
TEST(LoopConsistency, WhereOdometryIsWeakLoopsContradictEachOtherInTheSolution) {
  Graph graph = trials(1, 60, 1, 4);
  for (PoseGraphEdge& edge : graph.edges) edge.information(3, 3) = 1 / (0.2 * 0.2);
  for (int i = 0; i < 12; ++i) {
    const bool wrong = i == 4 || i == 9;
    graph.join_noisily(i, 30, EdgeKind::loop, away(0, 0, 0, wrong ? 4 : 0, 0, 0));
    graph.join_noisily(i, 31, EdgeKind::loop);
  }
  EXPECT_EQ(accepted(flags(graph)), 24);
  const PoseGraphSolution solution = solve_pose_graph(graph.chained(), graph.edges, {});
  for (std::size_t i = 0; i < 24; ++i) EXPECT_EQ(solution.edge_outlier[59 + i], i == 8 || i == 18) << i;
  EXPECT_LT(worst_error(solution.component_T_node, graph.truth).mm, 1.0);
}

TEST(LoopConsistency, TheLargestAgreeingSetJoinsTwoTrials) {
  Graph graph = trials(2, 15, 5, 5);
  const Vector6d shift = away(0.1, 0, 0.3, 3, 0, 0);
  graph.join(2, 17, EdgeKind::loop, shift);
  graph.join(3, 18, EdgeKind::loop, shift);
  graph.join(8, 20, EdgeKind::loop);
  graph.join(9, 22, EdgeKind::loop);
  graph.join(24, 11, EdgeKind::loop);  // pointing the other way
  EXPECT_EQ(flags(graph), (std::vector<bool>{false, false, true, true, true}));
}

// Forty loops join two trials, half of them falsely, each to another place. Only some of the loops are
// compared with each other. Which ones must not depend on the order of the loops, because in some orders
// every second loop is true.
TEST(LoopConsistency, OfManyLoopsTheSameAreComparedInAnyOrder) {
  Graph graph = trials(2, 40, 4, 5);
  const std::size_t odometry = graph.edges.size();
  for (int i = 0; i < 40; ++i)
    graph.join_noisily(i, 40 + i, EdgeKind::loop,
                       i % 2 == 0 ? away(0, 0, 0, 3.0 + i, 0, 0) : away(0, 0, 0, 0, 0, 0));
  const auto kept = [&] {
    std::set<int> from;
    const std::vector<bool> all = consistent_edges(graph.edges, kScaleSigma);
    for (std::size_t i = odometry; i < all.size(); ++i)
      if (all[i]) from.insert(graph.edges[i].from);
    return from;
  };
  const auto by_truth = [](bool true_first) {
    return [true_first](const PoseGraphEdge& a, const PoseGraphEdge& b) {
      return std::pair((a.from % 2 == 1) != true_first, a.from) <
             std::pair((b.from % 2 == 1) != true_first, b.from);
    };
  };
  const std::set<int> in_order = kept();
  // True and false loops alternate, so that every second loop is true, or every second loop is false.
  for (const bool true_first : {true, false}) {
    std::sort(graph.edges.begin() + static_cast<std::ptrdiff_t>(odometry), graph.edges.end(),
              by_truth(true_first));
    std::vector<PoseGraphEdge> woven(graph.edges.begin(),
                                     graph.edges.begin() + static_cast<std::ptrdiff_t>(odometry));
    for (std::size_t i = 0; i < 20; ++i) {
      woven.push_back(graph.edges[odometry + i]);
      woven.push_back(graph.edges[odometry + 20 + i]);
    }
    graph.edges = woven;
    EXPECT_EQ(kept(), in_order) << true_first;
  }
}

TEST(LoopConsistency, ATentativeLoopWaitsForAnother) {
  Graph graph = trials(2, 15, 5, 7);
  graph.join(8, 20, EdgeKind::loop);
  graph.edges.back().tentative = true;
  EXPECT_EQ(accepted(flags(graph)), 0);
  graph.join(9, 22, EdgeKind::loop, away(0.1, 0, 0.3, 3, 0, 0));  // to another place
  graph.edges.back().tentative = true;
  EXPECT_EQ(accepted(flags(graph)), 0);
  graph.join(10, 21, EdgeKind::loop);
  graph.edges.back().tentative = true;
  EXPECT_EQ(flags(graph), (std::vector<bool>{true, false, true}));
}

TEST(LoopConsistency, TrialsJoinInAChainAndThenJudgeTheRest) {
  Graph graph = trials(4, 15, 4, 8);
  graph.join(20, 5, EdgeKind::loop);
  graph.join(18, 50, EdgeKind::loop);
  graph.join(50, 40, EdgeKind::loop);
  graph.join(2, 35, EdgeKind::loop);  // closes the ring of trials
  graph.join(3, 36, EdgeKind::loop, away(0, 0, 0.5, 4, 0, 0));
  graph.join(7, 34, EdgeKind::loop);
  EXPECT_EQ(flags(graph), (std::vector<bool>{true, true, true, true, false, true}));
}

TEST(LoopConsistency, NothingAtAllAndNonsense) {
  EXPECT_TRUE(consistent_edges({}, kScaleSigma).empty());
  PoseGraphEdge loop{4, 4, Pose::Identity(), Matrix6d::Identity(), EdgeKind::loop};
  EXPECT_EQ(consistent_edges({loop}, kScaleSigma).size(), 1u);
  loop.to = 5;
  loop.from_T_to.translation().x() = std::numeric_limits<double>::quiet_NaN();
  PoseGraphEdge odometry{4, 5, Pose::Identity(), Matrix6d::Zero(), EdgeKind::odometry};
  EXPECT_EQ(consistent_edges({odometry, loop}, kScaleSigma), (std::vector<bool>{true, false}));
  EXPECT_THROW(consistent_edges({odometry}, -0.1), Error);
}

}  // namespace
}  // namespace gelslam
