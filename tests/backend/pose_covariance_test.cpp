#include "gelslam/backend/pose_covariance.hpp"

#include <gtest/gtest.h>

#include <Eigen/Eigenvalues>
#include <Eigen/LU>
#include <limits>

#include "gelslam/backend/uncertain_motion.hpp"
#include "synthetic_graph.hpp"

namespace gelslam {
namespace {

/// Returns the inverse of a relative pose, b_T_a for a_T_b, with its covariance.
UncertainMotion inverse(const UncertainMotion& motion) {
  // (T exp(n))^-1 = T^-1 exp(-Ad(T) n)
  const Matrix6d to_start = adjoint(motion.from_T_to.pose);
  return {motion.from_T_to.inverse(), -to_start * motion.by_scale};
}

std::map<int, Matrix6d> covariances(const Graph& graph, int gauge, double scale_sigma) {
  const PoseCovariances known =
      pose_covariances(graph.edges, solve_pose_graph(graph.truth, graph.edges, {}), gauge, {}, scale_sigma);
  std::map<int, Matrix6d> covariances;
  for (const auto& [id, node] : known.component_T_node) covariances[id] = node.total_covariance(known.scale);
  return covariances;
}

double relative_gap(const Matrix6d& a, const Matrix6d& b) { return (a - b).norm() / b.norm(); }

// Without loops, the covariance of a pose is that of the composed edges, in either direction.
TEST(PoseCovariance, OfAChainIsThatOfItsComposedEdges) {
  const Graph graph = trials(1, 12, 5);
  for (const double scale_sigma : {0.0, 0.1}) {
    const auto from_start = covariances(graph, 0, scale_sigma);
    const auto from_end = covariances(graph, 11, scale_sigma);
    EXPECT_EQ(from_start.at(0).norm(), 0.0);
    UncertainMotion motion;
    const ScaleCovariance scale = prior_scale_covariance(scale_sigma);
    for (const PoseGraphEdge& edge : graph.edges) {
      motion = compose(motion, uncertain_motion(edge));
      EXPECT_LT(relative_gap(from_start.at(edge.to), motion.total_covariance(scale)), 1e-3);
    }
    EXPECT_LT(relative_gap(from_end.at(0), inverse(motion).total_covariance(scale)), 1e-3);
  }
}

// Compares the covariances with the inverse of the dense information matrix.
TEST(PoseCovariance, OfALoopIsThatOfTheDenseInverse) {
  Graph graph = trials(1, 6, 5);
  graph.join(0, 5, EdgeKind::loop);
  graph.join(1, 4, EdgeKind::loop);
  Eigen::MatrixXd information = Eigen::MatrixXd::Zero(36, 36);
  for (const PoseGraphEdge& edge : graph.edges) {
    Eigen::MatrixXd derivative = Eigen::MatrixXd::Zero(6, 36);
    derivative.middleCols(6 * edge.to, 6).setIdentity();
    derivative.middleCols(6 * edge.from, 6) = -adjoint(edge.from_T_to.inverse());
    information += derivative.transpose() * edge.information * derivative;
  }
  const Eigen::MatrixXd dense = information.bottomRightCorner(30, 30).inverse();
  const auto found = covariances(graph, 0, 0.0);
  for (int id = 1; id < 6; ++id)
    EXPECT_LT(relative_gap(found.at(id), dense.block(6 * (id - 1), 6 * (id - 1), 6, 6)), 1e-3);
  EXPECT_LT(found.at(5).norm(), 0.5 * covariances(trials(1, 6, 5), 0, 0.0).at(5).norm())
      << "loops reduce drift";
}

TEST(PoseCovariance, AMotionThatNoEdgeShowsIsKnownToTheSensorsWidthOnly) {
  Graph graph = trials(1, 2, 5);
  graph.edges[0].information.row(4).setZero();
  graph.edges[0].information.col(4).setZero();
  EXPECT_NEAR(std::sqrt(covariances(graph, 0, 0.0).at(1)(4, 4)), 20.0, 0.01);
}

TEST(PoseCovariance, OtherComponentsAndOutliersSayNothing) {
  Graph graph = trials(1, 3, 5);
  graph.truth[7] = rolled(7, 5.0);
  graph.truth[8] = rolled(8, 5.0);
  graph.join(7, 8, EdgeKind::odometry);
  Vector6d far = Vector6d::Zero();
  far[4] = 5.0;
  graph.join(0, 2, EdgeKind::loop, far);
  const auto found = covariances(graph, 0, 0.0);
  EXPECT_EQ(found.at(7).norm(), 0.0) << "it is the other's gauge";
  EXPECT_LT(relative_gap(found.at(2), covariances(trials(1, 3, 5), 0, 0.0).at(2)), 1e-3);
}

TEST(PoseCovariance, OfAPartThatOnlyOutliersJoinSaysThatNothingWasMeasured) {
  Graph graph = trials(2, 3, 5);
  for (const int id : {0, 1, 2}) {
    Vector6d far = Vector6d::Zero();
    far[4] = 50.0 * (id + 1);
    graph.join(id, id + 3, EdgeKind::loop, far);
  }
  PoseGraphSolution solution = solve_pose_graph(graph.truth, graph.edges, {});
  for (std::size_t i = 0; i < graph.edges.size(); ++i)
    solution.edge_outlier[i] = graph.edges[i].kind == EdgeKind::loop;
  const auto known = pose_covariances(graph.edges, solution, 0, {}, 0.0).component_T_node;
  EXPECT_LT(known.at(2).from_T_to.worst_sigma_mm(), 1.0);
  EXPECT_NEAR(known.at(3).from_T_to.worst_sigma_mm(), 20.0, 0.1) << "the first loop's width";
  EXPECT_GT(known.at(5).from_T_to.worst_sigma_mm(), 20.0);
}

// Compares with the inverse of the dense information matrix of all poses and the scale. A motion relative to
// a node is composed with the covariance of the node for a known scale, and with the derivative of the node
// by the scale.
TEST(PoseCovariance, FollowsTheScaleAsTheDenseInverseSays) {
  Graph graph = roll_of_400_degrees({1.0, 1.0}, true);
  graph.join(3, 93, EdgeKind::loop);
  constexpr double kSigma = 0.1;
  constexpr int kPoses = 6 * 101;
  Eigen::MatrixXd information = Eigen::MatrixXd::Zero(kPoses + 4, kPoses + 4);
  information.bottomRightCorner(4, 4) = prior_scale_covariance(kSigma).inverse();
  for (const PoseGraphEdge& edge : graph.edges) {
    Eigen::MatrixXd derivative = Eigen::MatrixXd::Zero(6, kPoses + 4);
    derivative.middleCols(6 * edge.to, 6).setIdentity();
    derivative.middleCols(6 * edge.from, 6) = -adjoint(edge.from_T_to.inverse());
    derivative.rightCols(4) = -motion_by_gradient_scale(edge);
    information += derivative.transpose() * edge.information * derivative;
  }
  const Eigen::MatrixXd dense = information.bottomRightCorner(kPoses - 2, kPoses - 2).inverse();
  const PoseCovariances known =
      pose_covariances(graph.edges, solve_pose_graph(graph.truth, graph.edges, {}), 0, {}, kSigma);
  EXPECT_LT((known.scale - dense.bottomRightCorner(4, 4)).norm(), 1e-3 * known.scale.norm());
  for (const int id : {1, 40, 90, 100}) {
    const UncertainMotion& node = known.component_T_node.at(id);
    const Matrix6d of_node = dense.block(6 * (id - 1), 6 * (id - 1), 6, 6);
    EXPECT_LT(relative_gap(node.total_covariance(known.scale), of_node), 1e-3) << id;
    const Eigen::MatrixXd with_scale = dense.block(6 * (id - 1), kPoses - 6, 6, 4);
    EXPECT_LT((node.by_scale * known.scale - with_scale).norm(), 1e-3 * with_scale.norm()) << id;
  }
}

// In a tree with branches and edges in both directions, there is only one path between two nodes.
TEST(MotionsBetween, OfATreeIsWhatTheSolvedGraphKnows) {
  Graph tree;
  for (int id = 0; id < 30; ++id) tree.truth[id] = rolled(id, 7);
  for (int id = 1; id < 30; ++id) {
    const int parent = id % 7 == 0 ? id / 2 : id - 1;
    tree.join(id % 3 == 0 ? id : parent, id % 3 == 0 ? parent : id, EdgeKind::odometry);
  }
  std::vector<bool> outlier(tree.edges.size(), false);
  for (const double scale_sigma : {0.0, 0.1}) {
    const auto motion_between = motions_between(tree.edges, outlier, scale_sigma);
    for (const auto& [from, to] :
         {std::pair(20, 27), std::pair(27, 20), std::pair(5, 29), std::pair(0, 13)}) {
      const Matrix6d known = covariances(tree, from, scale_sigma).at(to);
      EXPECT_LT(relative_gap(motion_between(from, to)->covariance, known), 1e-3) << from << ' ' << to;
    }
  }
  EXPECT_FALSE(motions_between(tree.edges, outlier, 0.0)(0, 77));
  outlier.back() = true;  // it leads to node 29
  EXPECT_FALSE(motions_between(tree.edges, outlier, 0.0)(5, 29));
}

}  // namespace
}  // namespace gelslam
