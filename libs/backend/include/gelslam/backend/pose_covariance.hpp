#pragma once

#include <map>
#include <vector>

#include "gelslam/backend/pose_graph.hpp"

namespace gelslam {

/// What all edges of a solved graph together know: covariances of right perturbations (rad, mm) of the poses
/// relative to the node `gauge`, for every node of its component. A gradient scale of 1 +-
/// `gradient_scale_sigma` (0: none), common to all edges, is estimated beside the poses. Loops count with
/// their robust weight, outliers not at all. `edges` are those that were solved. Throws Error when the
/// solution is of other edges. Source: own; the selected inverse after Takahashi et al. (1973).
std::map<int, Matrix6d> pose_covariances(const std::vector<PoseGraphEdge>& edges,
                                         const PoseGraphSolution& solution, int gauge,
                                         const PoseGraphOptions& options, double gradient_scale_sigma);

}  // namespace gelslam
