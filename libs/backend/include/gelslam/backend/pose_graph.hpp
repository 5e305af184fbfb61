#pragma once

#include <map>
#include <vector>

#include "gelslam/core/pose_graph_edge.hpp"

namespace gelslam {

/// Weak prior on every edge: two frames that overlap differ by at most about one radian and the sensor's
/// width, even along directions that the surface does not show. One standard deviation per axis.
inline constexpr double kOverlapSigmaRad = 1.0, kOverlapSigmaMm = 20.0;

/// Two measurements of one motion contradict each other when they differ by more than this many standard
/// deviations of their combined covariance. A loop with a larger residual is an outlier and has no weight.
/// The limit is wide because registrations share errors that their information does not contain.
inline constexpr double kMaxMismatch = 9.0;

struct PoseGraphOptions {
  double loop_loss_scale = 3.0;  ///< Cauchy kernel on whitened loop residuals, in standard deviations
};

/// The robust kernel of loops: a Cauchy kernel that is constant beyond kMaxMismatch. `residual` is the
/// whitened residual norm of a loop and `scale` is loop_loss_scale, both in standard deviations.
/// robust_cost() returns twice the cost, and robust_weight() the factor (0 to 1) that multiplies the loop's
/// information.
double robust_cost(double residual, double scale);
double robust_weight(double residual, double scale);

/// K unknowns with expected value 0 that all edges share. They model systematic errors of the sensor, such as
/// a gradient model that reads every slope too steep.
struct SharedUnknowns {
  /// Per edge, a 6xK derivative: if the unknowns are u, the edge measures from_T_to * exp(edge_by_unknown *
  /// u).
  std::vector<Eigen::Matrix<double, 6, Eigen::Dynamic>> edge_by_unknown;
  /// Prior information (inverse covariance) of the unknowns, KxK and positive definite. It is empty when
  /// there are no shared unknowns.
  Eigen::MatrixXd information;
};

struct PoseGraphSolution {
  /// Solved pose of every node in the frame of its component. That frame is fixed by the component's smallest
  /// node id, which is held at its initial pose.
  std::map<int, Pose> component_T_node;
  /// For every node, the smallest node id of its connected component.
  std::map<int, int> component_of_node;
  Eigen::VectorXd shared_unknowns;    ///< Estimated unknowns; empty when none were asked for.
  std::vector<double> edge_residual;  ///< whitened residual norm per edge, in the order edges were given
  /// True for loops that the rest of the graph contradicts; never true for odometry.
  std::vector<bool> edge_outlier;
  double final_cost = 0;  ///< Half the sum of squared residuals, with the robust kernel for loops.
  int iterations = 0;
};

/// Solves an SE(3) pose graph with Ceres. Each connected component is solved with its own gauge. The initial
/// poses need only be right along each chain of odometry. Shared unknowns are estimated together with the
/// poses, starting from 0. The result is deterministic. Throws Error for an edge that names an unknown node,
/// joins a node to itself or holds a number that is not finite; for an information matrix that is not
/// symmetric or not positive semi-definite; and for shared unknowns whose sizes do not match or whose prior
/// information is not positive definite.
PoseGraphSolution solve_pose_graph(const std::map<int, Pose>& initial_map_T_node,
                                   const std::vector<PoseGraphEdge>& edges, const PoseGraphOptions& options,
                                   const SharedUnknowns& shared = {});

/// Decides which edges may shape the map and returns one flag per edge, which is always true for odometry. A
/// loop is accepted when it agrees with the odometry between its ends: together they close a cycle, whose
/// error is compared with its covariance (after pairwise consistency; Mangelson et al., ICRA 2018). The part
/// of the error that a gradient scale common to all edges can explain, with the prior standard deviation
/// `gradient_scale_sigma` about 1, is no contradiction. Trials are not connected by odometry. Two of them are
/// joined by the loop with which most other loops agree, provided that another loop agrees or that this loop
/// is not `tentative`. Until two trials are joined, the flags of the loops between them are false. The order
/// of the edges only breaks ties. Throws Error for a negative sigma; solve_pose_graph() checks the edges
/// themselves.
std::vector<bool> consistent_edges(const std::vector<PoseGraphEdge>& edges, double gradient_scale_sigma);

}  // namespace gelslam
