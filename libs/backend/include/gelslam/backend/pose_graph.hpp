#pragma once

#include <cstdint>
#include <map>
#include <vector>

#include "gelslam/core/se3.hpp"

namespace gelslam {

enum class EdgeKind { odometry, loop };

/// A measured relative pose. `information` is the inverse covariance (rad, mm; order as in se3.hpp) of the right
/// perturbation: true from_T_to = from_T_to * exp(noise).
struct PoseGraphEdge {
  int from = 0;
  int to = 0;
  Pose from_T_to = Pose::Identity();
  Matrix6d information = Matrix6d::Identity();
  EdgeKind kind = EdgeKind::odometry;
};

struct PoseGraphOptions {
  int max_iterations = 50;
  double loop_loss_scale = 3.0;     ///< robust (Cauchy) kernel on whitened loop residuals, in standard deviations
  bool estimate_slope_gain = false; ///< see PoseGraphSolution::slope_gain
  double slope_gain_sigma = 0.05;   ///< prior: gain = 1 +- this
};

struct PoseGraphSolution {
  std::map<int, Pose> group_T_node;   ///< every node; the frame of a group is its smallest node id, held at its initial pose
  std::map<int, int> group_of_node;   ///< smallest node id of the connected component
  double slope_gain = 1.0;            ///< read slope / true slope, shared by all edges (1 when not estimated)
  std::vector<double> edge_residual;  ///< whitened residual norm per edge, in the order edges were given
  double initial_cost = 0, final_cost = 0;
  int iterations = 0;
  bool converged = false;
};

/// SE(3) pose graph on Ceres. Components not joined by edges are separate groups, each with its own gauge.
/// Model of an edge with gain g: the measured rotation vector is (g*wx, g*wy, wz) and the measured translation
/// (tx, ty, g*tz) for a true motion (w, t): slopes read g times too steep tilt and deepen everything they measure.
/// Deterministic. Throws Error on edges that name unknown nodes or carry non-finite numbers.
PoseGraphSolution solve_pose_graph(const std::map<int, Pose>& initial_map_T_node, const std::vector<PoseGraphEdge>& edges,
                                   const PoseGraphOptions& options);

}  // namespace gelslam
