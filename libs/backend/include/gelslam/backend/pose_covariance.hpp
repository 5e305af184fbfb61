#pragma once

#include <map>
#include <vector>

#include "gelslam/backend/pose_graph.hpp"

namespace gelslam {

/// What all edges of a solved graph together know.
struct GraphCovariances {
  std::map<int, Matrix6d>
      gauge_T_node;                 ///< right perturbations (rad, mm), every node of the gauge's component
  Eigen::MatrixXd shared_unknowns;  ///< KxK; empty where there are none
};

/// Covariances of the poses of a solved graph relative to the node `gauge`, with the shared unknowns
/// estimated beside the poses. Loops count with their robust weight, outliers not at all. `edges` are those
/// that were solved. Throws Error when the solution is of other edges. Source: own; the selected inverse
/// after Takahashi et al. (1973).
GraphCovariances graph_covariances(const std::vector<PoseGraphEdge>& edges, const PoseGraphSolution& solution,
                                   int gauge, const PoseGraphOptions& options, const SharedUnknowns& shared);

/// Poses alone, with a gradient scale of 1 +- `gradient_scale_sigma`, common to all edges; 0: none.
std::map<int, Matrix6d> pose_covariances(const std::vector<PoseGraphEdge>& edges,
                                         const PoseGraphSolution& solution, int gauge,
                                         const PoseGraphOptions& options, double gradient_scale_sigma);

}  // namespace gelslam
