#pragma once

#include <map>
#include <vector>

#include "gelslam/backend/pose_graph.hpp"

namespace gelslam {

/// Covariances of the poses of a solved graph, from all edges: that of gauge_T_node as a right perturbation
/// (rad, mm) for every node of the gauge's component. Loops count with their robust weight, outliers not at
/// all. A gradient scale of 1 +- `gradient_scale_sigma`, common to all edges, is estimated with the poses; 0:
/// none. `edges` are those that were solved. Throws Error when the solution is of other edges. Source: own;
/// the diagonal of the inverse after Takahashi et al. (1973).
std::map<int, Matrix6d> pose_covariances(const std::vector<PoseGraphEdge>& edges,
                                         const PoseGraphSolution& solution, int gauge,
                                         const PoseGraphOptions& options, double gradient_scale_sigma);

}  // namespace gelslam
