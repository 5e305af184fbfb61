#include <gtest/gtest.h>

#include "gelslam/backend/uncertain_motion.hpp"
#include "synthetic_graph.hpp"

namespace gelslam {
namespace {

/// A solution with the gradient scale that was estimated together with the poses.
struct ScaleSolution {
  PoseGraphSolution solution;
  ReadOverTrue scale;
};

ScaleSolution solve(const Graph& graph, double sigma = 0.1) {
  ScaleSolution result;
  result.solution = solve_with_gradient_scale(graph.chained(), graph.edges, {}, sigma);
  const Eigen::VectorXd& factor = result.solution.shared_unknowns;
  if (factor.size() == 0) return result;
  result.scale = {1.0 / (1.0 - factor[0]), 1.0 / (1.0 - factor[3])};
  return result;
}

TEST(PoseGraphGradientScale, IsRecoveredFromOneLoopAtAFullTurn) {
  const Graph graph = roll_of_400_degrees({1.05, 1.05}, true);
  const auto [solution, scale] = solve(graph);
  // The object rolls about one axis, which determines the scale along one axis. The prior 1 +- 0.1 has little
  // effect, because the turn of 6.3 rad is measured to 0.02 rad: its weight relative to the measurement is
  // (0.003 / 0.1)^2. The scale along the other axis is determined only by its effect on tz.
  const double told = std::max(scale.x, scale.y);
  EXPECT_NEAR(told, 1.05, 0.001);
  const WorstError error = worst_error(solution.component_T_node, graph.truth);
  EXPECT_LT(error.deg, 0.3);
  EXPECT_LT(error.mm, 0.1);
  // Without the loop, the error is 5 % of 400 degrees.
  EXPECT_GT(worst_error(graph.chained(), graph.truth).deg, 15.0);
}

TEST(PoseGraphGradientScale, IsNotEstimatedWhereLoopsContradictEachOtherForAnotherReason) {
  Graph graph = roll_of_400_degrees({1.0, 1.0}, false);
  Noise noise(5);
  for (int to = 90; to <= 100; ++to) graph.join(to - 90, to, EdgeKind::loop, 4 * noise.tangent(0.002, 0.02));
  const PoseGraphSolution alone = solve_pose_graph(graph.chained(), graph.edges, {});
  const PoseGraphSolution solution = solve(graph).solution;
  EXPECT_EQ(solution.shared_unknowns.size(), 0);
  EXPECT_EQ(solution.final_cost, alone.final_cost);
  for (PoseGraphEdge& edge : graph.edges) edge.from_T_to = with_scale(edge.from_T_to, {1.05, 1.05});
  EXPECT_NEAR(std::max(solve(graph).scale.x, solve(graph).scale.y), 1.05, 0.02);  // and a scale besides
}

TEST(PoseGraphGradientScale, DiffersAlongTheTwoAxesAndALoopTurnedByHalfATwistIsNoSpecialCase) {
  Graph graph;
  for (int i = 0; i < 30; ++i) {
    graph.truth[i] = Pose::Identity();
    graph.truth[i].linear() =
        so3_exp({0, 0, M_PI * i / 29.0}) * so3_exp({0.2 * std::sin(i), 0.2 * std::cos(i), 0});
    graph.truth[i].translation() = Eigen::Vector3d(0.1 * i, 0, -0.05 * (i % 3));
  }
  for (int i = 0; i + 1 < 30; ++i) graph.join(i, i + 1, EdgeKind::odometry);
  for (int i = 0; i < 3; ++i) graph.join(i, 27 + i, EdgeKind::loop);
  for (PoseGraphEdge& edge : graph.edges) edge.from_T_to = with_scale(edge.from_T_to, {1.06, 0.98});
  const auto [solution, scale] = solve(graph, 1.0);
  // The model of the edges is linear in the scale. The remaining error is of second order, or due to the
  // prior.
  EXPECT_NEAR(scale.x, 1.06, 5e-4);
  EXPECT_NEAR(scale.y, 0.98, 5e-4);
  EXPECT_LT(worst_error(solution.component_T_node, graph.truth).deg, 0.1);
  EXPECT_GT(worst_error(graph.chained(), graph.truth).deg, 1.0);
}

TEST(PoseGraphGradientScale, NoisyLoopsOverKnownGroundDoNotFlattenSlopes) {
  // The motion goes to and fro, so that loops turn by little and hardly show the scale.
  constexpr int kPlaces = 12, kPasses = 12;
  constexpr double kSigmaRad = 0.02, kSigmaMm = 0.05;
  Noise noise(7);
  Graph graph;
  const auto place = [](int i) { return i / kPlaces % 2 == 0 ? i % kPlaces : kPlaces - 1 - i % kPlaces; };
  const auto join = [&](int from, int to, EdgeKind kind) {
    graph.join(from, to, kind, noise.tangent(kSigmaRad, kSigmaMm), kSigmaRad, kSigmaMm);
  };
  for (int i = 0; i < kPlaces * kPasses; ++i) graph.truth[i] = rolled(place(i), 4);
  for (int to = 1; to < kPlaces * kPasses; ++to) {
    join(to - 1, to, EdgeKind::odometry);
    for (int from = 0; from + kPlaces / 2 < to; ++from)
      if (std::abs(place(from) - place(to)) <= 1) join(from, to, EdgeKind::loop);
  }
  constexpr double kPriorSigma = 0.1;
  EXPECT_EQ(solve(graph, kPriorSigma).solution.shared_unknowns.size(), 0);
  // Derivatives at the measured motions have the same noise as the residuals, which biases the scale.
  const Eigen::VectorXd at_measured =
      solve_pose_graph(graph.chained(), graph.edges, {}, gradient_scale_unknowns(graph.edges, kPriorSigma))
          .shared_unknowns;
  EXPECT_GT(at_measured.cwiseAbs().maxCoeff(), kPriorSigma);
}

TEST(PoseGraphGradientScale, AKnownScaleCorrectsTheEdges) {
  const Graph graph = roll_of_400_degrees({1.05, 1.02}, false);
  const Eigen::Vector4d known(1.0 - 1.0 / 1.05, 0, 0, 1.0 - 1.0 / 1.02);
  std::vector<PoseGraphEdge> edges = graph.edges;
  for (PoseGraphEdge& edge : edges) edge.from_T_to = uncertain_motion(edge).corrected(known).from_T_to.pose;
  const PoseGraphSolution solution = solve_pose_graph(graph.chained(), edges, {});
  EXPECT_LT(worst_error(solution.component_T_node, graph.truth).deg, 0.05);
  EXPECT_GT(worst_error(graph.chained(), graph.truth).deg, 5.0);
  EXPECT_EQ(uncertain_motion(graph.edges.front()).corrected({}).from_T_to.pose.matrix(),
            graph.edges.front().from_T_to.matrix());
}

TEST(PoseGraphGradientScale, FramesAreLaidOnEachOtherWhereTheyTouch) {
  const ReadOverTrue scale{1.1, 1.1};
  // The read center of the contact is 0.6 mm below the sensor's origin.
  const Eigen::Vector3d read_center(0.7, -0.4, -0.6);
  Graph graph = roll_of_400_degrees({1.0, 1.0}, true);
  for (PoseGraphEdge& edge : graph.edges) {
    const Pose motion = edge.from_T_to;
    edge.from_T_to = with_scale(motion, scale);
    Eigen::Vector3d touched = read_center;
    touched.z() /= scale.mean();
    Eigen::Vector3d in_from = motion * touched;
    in_from.z() *= scale.mean();
    edge.from_T_to.translation() = in_from - edge.from_T_to.linear() * read_center;
    edge.shared_center_mm = read_center;
  }
  const auto worst = [&] { return worst_error(solve(graph, 1.0).solution.component_T_node, graph.truth); };
  EXPECT_LT(worst().deg, 0.01);
  EXPECT_LT(worst().mm, 0.02);
  for (PoseGraphEdge& edge : graph.edges) edge.shared_center_mm.setZero();
  EXPECT_GT(worst().mm, 0.1);  // with the origin as center, the object becomes too large
}

}  // namespace
}  // namespace gelslam
