#pragma once

#include <map>
#include <vector>

#include "gelslam/core/pose_graph_edge.hpp"

namespace gelslam {

/// One standard deviation, per axis, to which overlapping frames are known whatever they show: a radian, and
/// the sensor's width.
inline constexpr double kOverlapSigmaRad = 1.0, kOverlapSigmaMm = 20.0;

/// Two measurements of one motion contradict each other when they differ by more than this many standard
/// deviations of their combined covariance. A loop with a larger residual is an outlier and has no weight.
/// The limit is wide because registrations share errors that their information does not contain.
inline constexpr double kMaxMismatch = 9.0;

struct PoseGraphOptions {
  double loop_loss_scale = 3.0;  ///< Cauchy kernel on whitened loop residuals, in standard deviations
};

/// The Cauchy kernel, cut off at kMaxMismatch: twice the cost of a loop with this whitened residual, and the
/// share of its information that remains. `scale`: loop_loss_scale, in standard deviations.
double robust_cost(double residual, double scale);
double robust_weight(double residual, double scale);

/// Unknowns about 0 that all edges share, K of them: what a sensor's model of slopes reads wrong.
struct SharedUnknowns {
  /// For each edge, 6xK: what it measures if the unknowns are u is from_T_to * exp(edge_by_unknown * u).
  std::vector<Eigen::Matrix<double, 6, Eigen::Dynamic>> edge_by_unknown;
  /// What is known of the unknowns besides the edges, KxK and positive definite. It is empty where there are
  /// none.
  Eigen::MatrixXd information;
};

struct PoseGraphSolution {
  std::map<int, Pose> component_T_node;  ///< every node; the frame of a component is its smallest node id,
                                         ///< held at its initial pose
  std::map<int, int> component_of_node;  ///< smallest node id of the connected component
  Eigen::VectorXd shared_unknowns;       ///< empty when none were asked for
  std::vector<double> edge_residual;     ///< whitened residual norm per edge, in the order edges were given
  std::vector<bool> edge_outlier;  ///< loops that the rest of the graph contradicts; never true for odometry
  double final_cost = 0;           ///< robust cost
  int iterations = 0;
};

/// Solves an SE(3) pose graph with Ceres. Components not joined by edges are separate components, each with
/// its own gauge. Initial poses need only be right within a chain of odometry. Shared unknowns are estimated
/// with the poses, starting from 0. Deterministic. Throws Error on edges that name unknown nodes, join a node
/// to itself or carry non-finite numbers, on information that is not symmetric or not positive semi-definite,
/// and on shared unknowns whose sizes do not fit or whose information is not positive definite. Source: own.
PoseGraphSolution solve_pose_graph(const std::map<int, Pose>& initial_map_T_node,
                                   const std::vector<PoseGraphEdge>& edges, const PoseGraphOptions& options,
                                   const SharedUnknowns& shared = {});

/// Says which edges may shape the map, with one flag per edge, always true for odometry. A loop has to agree
/// with the odometry between its ends: both close a cycle, whose error is judged by its covariance (after
/// pairwise consistency; Mangelson et al., ICRA 2018). What a gradient scale of 1 +- `gradient_scale_sigma`,
/// common to all edges, explains is no contradiction. Trials, which odometry does not join, are joined by the
/// loop that most others agree with, if it is not `tentative` or another one agrees. Until then their loops
/// wait, with the flag false. Depends on the edges' order only to break ties. Throws Error for a negative
/// sigma; what an edge holds is checked by solve_pose_graph().
std::vector<bool> consistent_edges(const std::vector<PoseGraphEdge>& edges, double gradient_scale_sigma);

}  // namespace gelslam
