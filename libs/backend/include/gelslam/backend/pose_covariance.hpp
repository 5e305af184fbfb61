#pragma once

#include <map>
#include <vector>

#include "gelslam/backend/pose_graph.hpp"
#include "gelslam/backend/uncertain_motion.hpp"

namespace gelslam {

/// Marginal covariances of the nodes of a solved pose graph.
struct PoseCovariances {
  /// For each node: its solved pose, its covariance relative to the gauge node of its component if the
  /// gradient scale were known exactly (mm and rad, as a right perturbation), and the derivative of the pose
  /// with respect to the gradient scale.
  std::map<int, UncertainMotion> component_T_node;
  /// Covariance of the gradient scale's four factors, which all edges share.
  ScaleCovariance scale = ScaleCovariance::Zero();
};

/// Computes the marginal covariance of every node and of the gradient scale at the solution of a pose graph.
/// The gauge of a component (the node whose covariance is 0) is `anchor` in its own component and the
/// smallest node in all others. `gradient_scale_sigma` is the prior standard deviation of the gradient scale
/// about 1; with 0 the scale counts as known. Loops count with the weight that their robust kernel leaves,
/// and outliers do not count. `edges` must be the edges that were solved. The time is proportional to the
/// number of non-zeros in the Cholesky factor. Throws Error when `solution` belongs to other edges, or when
/// the edges do not determine the poses. The method is not in the paper; the selected inverse follows
/// Takahashi et al. (1973).
PoseCovariances pose_covariances(const std::vector<PoseGraphEdge>& edges, const PoseGraphSolution& solution,
                                 int anchor, const PoseGraphOptions& options, double gradient_scale_sigma);

}  // namespace gelslam
