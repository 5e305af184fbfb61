#pragma once

#include <map>
#include <vector>

#include "gelslam/backend/pose_graph.hpp"
#include "gelslam/backend/uncertain_motion.hpp"

namespace gelslam {

/// Holds what all edges of a solved graph together know.
struct PoseCovariances {
  /// Every node has its pose as it was solved, relative to the gauge of its component, its noise for a
  /// gradient scale that is known, and how it follows the scale.
  std::map<int, UncertainMotion> component_T_node;
  ScaleCovariance scale = ScaleCovariance::Zero();  ///< of the gradient scale, common to all edges
};

/// The gauge of a component is its smallest node, or `anchor`. A gradient scale of 1 +-
/// `gradient_scale_sigma` (0: it is known) is estimated beside the poses. Loops count with their robust
/// weight, outliers not at all. `edges` are those that were solved. Takes time in proportion to the entries
/// of the Cholesky factor. Throws Error when the solution is of other edges. Source: own; the selected
/// inverse after Takahashi et al. (1973).
PoseCovariances pose_covariances(const std::vector<PoseGraphEdge>& edges, const PoseGraphSolution& solution,
                                 int anchor, const PoseGraphOptions& options, double gradient_scale_sigma);

}  // namespace gelslam
