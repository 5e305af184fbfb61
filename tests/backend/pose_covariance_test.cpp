#include "gelslam/backend/pose_covariance.hpp"

#include <gtest/gtest.h>

#include <Eigen/Eigenvalues>
#include <Eigen/LU>
#include <limits>

#include "gelslam/backend/uncertain_motion.hpp"
#include "synthetic_graph.hpp"

namespace gelslam {
namespace {

/// a_T_b to b_T_a.
UncertainMotion inverse(const UncertainMotion& motion) {
  // (T exp(n))^-1 = T^-1 exp(-Ad(T) n)
  const Matrix6d to_start = adjoint(motion.from_T_to.pose);
  return {motion.from_T_to.inverse(), -to_start * motion.by_scale};
}

std::map<int, Matrix6d> covariances(const Graph& graph, int gauge, double scale_sigma) {
  return pose_covariances(graph.edges, solve_pose_graph(graph.truth, graph.edges, {}), gauge, {},
                          scale_sigma);
}

double relative_gap(const Matrix6d& a, const Matrix6d& b) { return (a - b).norm() / b.norm(); }

// Without loops the graph knows what its edges say one after the other, in either direction.
TEST(PoseCovariance, OfAChainIsThatOfItsComposedEdges) {
  const Graph graph = trials(1, 12, 5);
  for (const double scale_sigma : {0.0, 0.1}) {
    const auto from_start = covariances(graph, 0, scale_sigma);
    const auto from_end = covariances(graph, 11, scale_sigma);
    EXPECT_EQ(from_start.at(0).norm(), 0.0);
    UncertainMotion motion;
    for (const PoseGraphEdge& edge : graph.edges) {
      motion = compose(motion, uncertain_motion(edge));
      EXPECT_LT(relative_gap(from_start.at(edge.to), motion.total_covariance(scale_sigma)), 1e-3);
    }
    EXPECT_LT(relative_gap(from_end.at(0), inverse(motion).total_covariance(scale_sigma)), 1e-3);
  }
}

// The inverse of the information as it is, without what makes it fast.
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
  EXPECT_FALSE(found.contains(7));
  EXPECT_LT(relative_gap(found.at(2), covariances(trials(1, 3, 5), 0, 0.0).at(2)), 1e-3);
}

// A tree with branches and edges in both directions, where the one path between two nodes is all there is.
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
