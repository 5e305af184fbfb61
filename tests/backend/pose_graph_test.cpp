#include <gtest/gtest.h>

#include <limits>

#include "gelslam/core/error.hpp"
#include "synthetic_graph.hpp"
#include "whitened_graph.hpp"

namespace gelslam {
namespace {

/// The information that the pose graph adds to every edge, because two frames that overlap are close.
const Matrix6d kOverlapPrior = backend::detail::with_overlap_prior(Matrix6d::Zero());

TEST(PoseGraph, NodesWithoutEdgesStayAndAreTheirOwnComponents) {
  std::map<int, Pose> poses{{3, rolled(2, 7)}, {8, rolled(9, 7)}};
  const PoseGraphSolution solution = solve_pose_graph(poses, {}, {});
  EXPECT_LT(worst_error(solution.component_T_node, poses).mm, 1e-12);
  EXPECT_EQ(solution.component_of_node, (std::map<int, int>{{3, 3}, {8, 8}}));
}

TEST(PoseGraph, RecoversTruthFromNoiseFreeEdgesWhateverTheStart) {
  Graph graph = trials(1, 40, 9);
  graph.join(0, 39, EdgeKind::loop);
  graph.join(5, 30, EdgeKind::loop);
  Noise noise(1);
  std::map<int, Pose> start = graph.truth;
  for (auto& [id, pose] : start)
    if (id > 0) pose = pose * se3_exp(noise.tangent(0.05, 1.0));
  EXPECT_GT(worst_error(start, graph.truth).deg, 1.0);
  const PoseGraphSolution solution = solve_pose_graph(start, graph.edges, {});
  EXPECT_LT(solution.final_cost, 1e-8);
  const WorstError error = worst_error(solution.component_T_node, graph.truth);
  EXPECT_LT(error.deg, 1e-5);
  EXPECT_LT(error.mm, 1e-5);
}

TEST(PoseGraph, KeepsTheSmallestNodeWhereItWas) {
  Graph graph = trials(1, 10, 5);
  graph.join(0, 9, EdgeKind::loop, Noise(3).tangent(0.02, 0.2));
  const Pose elsewhere = se3_exp(away(0.3, -0.2, 1.0, 5, -7, 2));
  std::map<int, Pose> start;
  for (const auto& [id, pose] : graph.truth) start[id + 100] = elsewhere * pose;
  for (PoseGraphEdge& edge : graph.edges) edge.from += 100, edge.to += 100;
  const PoseGraphSolution solution = solve_pose_graph(start, graph.edges, {});
  EXPECT_TRUE(solution.component_T_node.at(100).isApprox(start.at(100), 1e-12));
  EXPECT_EQ(solution.component_of_node.at(109), 100);
}

// Correlated noise: information with off-diagonal blocks. The minimum over node 1 of two edges is the
// solution of (A + B) x = A a + B b, computed here directly; rotations are kept at zero by the measurements.
TEST(PoseGraph, UsesTheWholeInformationMatrix) {
  Eigen::Matrix3d root;
  root << 3, 1, 0.5, 0, 2, -1, 0, 0, 4;
  const Eigen::Matrix3d a_information = root.transpose() * root, b_information = 5 * root * root.transpose();
  PoseGraphEdge a, b;
  a.to = b.to = 1;
  a.information.setIdentity();
  a.information.topLeftCorner<3, 3>() *= 1e8;
  b.information = a.information;
  a.information.bottomRightCorner<3, 3>() = a_information;
  b.information.bottomRightCorner<3, 3>() = b_information;
  const Eigen::Vector3d ta(0.1, 0.2, -0.1), tb(-0.2, 0.1, 0.3);
  a.from_T_to.translation() = ta;
  b.from_T_to.translation() = tb;
  const Eigen::Matrix3d prior = kOverlapPrior.bottomRightCorner<3, 3>();
  const Eigen::Matrix3d of_a = a_information + prior, of_b = b_information + prior;
  const Eigen::Vector3d expected = (of_a + of_b).inverse() * (of_a * ta + of_b * tb);
  const PoseGraphSolution solution =
      solve_pose_graph({{0, Pose::Identity()}, {1, Pose::Identity()}}, {a, b}, {});
  EXPECT_LT((solution.component_T_node.at(1).translation() - expected).norm(), 1e-6);
  EXPECT_NEAR(solution.edge_residual[0], std::sqrt((expected - ta).dot(of_a * (expected - ta))), 1e-6);
  EXPECT_NEAR(solution.edge_residual[1], std::sqrt((expected - tb).dot(of_b * (expected - tb))), 1e-6);
}

// In a ring of n equal edges, the node half way round is determined by two parallel chains of n/2 edges, so
// its variance is that of n/4 edges. From 200 rings its root mean square is estimated to 1/sqrt(2*200*3) = 3
// %; the tolerance of 12 % is four times that.
TEST(PoseGraph, ErrorsHaveTheCovarianceThatTheInformationPromises) {
  constexpr int kNodes = 8, kRings = 200;
  PoseGraphOptions options;
  options.loop_loss_scale = 1e6;  // practically a quadratic kernel, for which the closed form holds
  double sum = 0;
  for (int k = 0; k < kRings; ++k) {
    Graph graph;
    graph.noise = Noise(static_cast<std::uint64_t>(k));
    for (int i = 0; i < kNodes; ++i) graph.truth[i] = Pose::Identity();
    for (int i = 0; i < kNodes; ++i)
      graph.join_noisily(i, (i + 1) % kNodes, i + 1 < kNodes ? EdgeKind::odometry : EdgeKind::loop);
    const PoseGraphSolution solution = solve_pose_graph(graph.chained(), graph.edges, options);
    sum += so3_log(solution.component_T_node.at(kNodes / 2).linear()).squaredNorm() / 3;
  }
  const double expected = kSigmaRad * std::sqrt(kNodes / 4.0);
  EXPECT_NEAR(std::sqrt(sum / kRings), expected, 0.12 * expected);
}

TEST(PoseGraph, ClosesARollThatDrifted) {
  Graph graph;
  constexpr int kNodes = 90;  // 360 degrees in steps of 4, then 8 keyframes that see the start again
  Noise noise(7);
  for (int i = 0; i < kNodes + 8; ++i) graph.truth[i] = rolled(i, 4);
  for (int i = 0; i + 1 < kNodes + 8; ++i)
    graph.join(i, i + 1, EdgeKind::odometry, noise.tangent(0.01, 0.05), 0.01, 0.05);
  for (int i = 0; i < 8; ++i) graph.join(i, i + kNodes, EdgeKind::loop, noise.tangent(0.002, 0.02));
  const WorstError before = worst_error(graph.chained(), graph.truth);
  const PoseGraphSolution solution = solve_pose_graph(graph.chained(), graph.edges, {});
  const Pose end_error = graph.truth.at(kNodes).inverse() * solution.component_T_node.at(kNodes);
  EXPECT_GT(before.deg, 3.0);
  EXPECT_LT(rotation_angle_rad(end_error) / kDegree, 0.5);  // loops: 0.002 rad = 0.11 degrees each
  EXPECT_EQ(std::count(solution.edge_outlier.begin(), solution.edge_outlier.end(), true), 0);
}

TEST(PoseGraph, AFalseLoopAmongTrueOnesIsFoundAndDoesNotBendTheMap) {
  Graph graph = trials(1, 60, 6, 11);
  for (int i = 0; i < 10; ++i) graph.join_noisily(i, i + 49, EdgeKind::loop);
  const WorstError clean =
      worst_error(solve_pose_graph(graph.chained(), graph.edges, {}).component_T_node, graph.truth);
  PoseGraphEdge planted = graph.edges.back();
  planted.from = 12;
  planted.to = 40;  // 168 degrees away from 12, claimed to be the same place
  planted.from_T_to = se3_exp(away(0.01, 0, 0.5, 1, 1, 0));
  graph.edges.push_back(planted);

  const PoseGraphSolution solution = solve_pose_graph(graph.chained(), graph.edges, {});
  const WorstError error = worst_error(solution.component_T_node, graph.truth);
  EXPECT_LT(error.deg, clean.deg + 0.1);
  EXPECT_LT(error.mm, clean.mm + 0.05);
  ASSERT_EQ(solution.edge_outlier.size(), graph.edges.size());
  EXPECT_TRUE(solution.edge_outlier.back());
  EXPECT_EQ(std::count(solution.edge_outlier.begin(), solution.edge_outlier.end(), true), 1);
}

// A loop is wrong by ten or fifty standard deviations. The map must be the same as with the other loops
// alone.
TEST(PoseGraph, ALoopThatIsLeftOutHasNoWeight) {
  for (const double sigmas : {10.0, 50.0}) {
    Graph graph = trials(1, 60, 6);
    for (int i = 0; i < 10; ++i) graph.join_noisily(i, i + 49, EdgeKind::loop);
    const PoseGraphSolution without = solve_pose_graph(graph.chained(), graph.edges, {});
    graph.join(20, 24, EdgeKind::loop, away(0, 0, 0, 2 * sigmas * kSigmaMm, 0, 0));
    const PoseGraphSolution with = solve_pose_graph(graph.chained(), graph.edges, {});
    EXPECT_TRUE(with.edge_outlier.back()) << sigmas;
    EXPECT_LT(worst_error(with.component_T_node, without.component_T_node).mm, 0.02 * kSigmaMm) << sigmas;
  }
}

// A plane slides along x, and no edge has information about x. There the poses must stay at their initial
// values from tracking, and along the other axes they must be solved.
TEST(PoseGraph, InformationMayBeSingular) {
  constexpr double kStiffRad = 1e-5;  // so small that rotations do not move the end of the chain sideways
  Graph graph;
  for (int i = 0; i < 20; ++i) {
    graph.truth[i] = Pose::Identity();
    graph.truth[i].translation() = Eigen::Vector3d(0.5 * i, 0.1 * i, 0);
  }
  for (int i = 0; i + 1 < 20; ++i) graph.join(i, i + 1, EdgeKind::odometry, Vector6d::Zero(), kStiffRad);
  graph.join(0, 19, EdgeKind::loop, Vector6d::Zero(), kStiffRad);
  for (PoseGraphEdge& edge : graph.edges) {
    edge.information.row(3).setZero();
    edge.information.col(3).setZero();
  }
  graph.edges.back().from_T_to.translation() +=
      Eigen::Vector3d(3.0, 0.01, 0);  // its x is a guess, its y is known
  const PoseGraphSolution solution = solve_pose_graph(graph.chained(), graph.edges, {});
  const Eigen::Vector3d last = solution.component_T_node.at(19).translation();
  // Equal weights of 20 edges: y moves by 19/20 of the loop's 0.01; x by no more than the loop's own guess.
  EXPECT_NEAR(last.y(), 1.9 + 0.01 * 19 / 20, 1e-5);
  EXPECT_NEAR(last.x(), 9.5 + 3.0 * 19 / 20, 1e-3);
  EXPECT_FALSE(solution.edge_outlier.back());
}

TEST(PoseGraph, WithoutAnyInformationTrackingIsKept) {
  Graph graph = trials(1, 5, 5);
  for (PoseGraphEdge& edge : graph.edges) edge.information.setZero();
  const PoseGraphSolution solution = solve_pose_graph(graph.chained(), graph.edges, {});
  EXPECT_LT(worst_error(solution.component_T_node, graph.truth).mm, 1e-9);
}

TEST(PoseGraph, RefusesWhatIsNotAGraph) {
  const std::map<int, Pose> nodes{{0, Pose::Identity()}, {1, Pose::Identity()}};
  const double nan = std::numeric_limits<double>::quiet_NaN();
  const auto refuses = [&](auto spoil) {
    PoseGraphEdge edge;
    edge.to = 1;
    spoil(edge);
    EXPECT_THROW(solve_pose_graph(nodes, {edge}, {}), Error);
  };
  refuses([](PoseGraphEdge& e) { e.to = 2; });
  refuses([](PoseGraphEdge& e) { e.from = -1; });
  refuses([](PoseGraphEdge& e) { e.to = 0; });
  refuses([&](PoseGraphEdge& e) { e.from_T_to.translation().x() = nan; });
  refuses([](PoseGraphEdge& e) { e.from_T_to.linear() *= 2; });
  refuses([](PoseGraphEdge& e) { e.from_T_to.linear().col(0) *= -1; });
  refuses([&](PoseGraphEdge& e) { e.information(2, 2) = nan; });
  refuses([](PoseGraphEdge& e) { e.information(0, 1) = 0.5; });
  refuses([](PoseGraphEdge& e) { e.information(3, 3) = -1; });
  refuses([](PoseGraphEdge& e) { e.information *= std::numeric_limits<double>::infinity(); });

  std::map<int, Pose> broken = nodes;
  broken[1].translation().y() = nan;
  EXPECT_THROW(solve_pose_graph(broken, {}, {}), Error);
  PoseGraphOptions options;
  options.loop_loss_scale = 0;
  EXPECT_THROW(solve_pose_graph(nodes, {}, options), Error);
}

/// Tests wrong arguments for the unknowns that all edges share. gradient_scale_test.cpp tests their
/// estimation.
TEST(PoseGraph, RefusesSharedUnknownsThatDoNotFit) {
  const Graph graph = trials(1, 5, 4);
  const auto refuses = [&](auto spoil) {
    SharedUnknowns shared;
    shared.information = Eigen::MatrixXd::Identity(1, 1);
    shared.edge_by_unknown.assign(4, Eigen::Matrix<double, 6, Eigen::Dynamic>::Zero(6, 1));
    solve_pose_graph(graph.chained(), graph.edges, {}, shared);
    spoil(shared);
    EXPECT_THROW(solve_pose_graph(graph.chained(), graph.edges, {}, shared), Error);
  };
  refuses([](SharedUnknowns& s) { s.edge_by_unknown.pop_back(); });
  refuses([](SharedUnknowns& s) { s.information(0, 0) = -1; });
  refuses([](SharedUnknowns& s) { s.edge_by_unknown[3].resize(6, 5); });
  refuses([](SharedUnknowns& s) { s.edge_by_unknown[3](0, 0) = std::nan(""); });
  refuses([](SharedUnknowns& s) { s.information = Eigen::MatrixXd::Identity(3, 3); });
}

}  // namespace
}  // namespace gelslam
