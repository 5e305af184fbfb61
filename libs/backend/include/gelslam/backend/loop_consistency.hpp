#pragma once

#include <vector>

#include "gelslam/backend/pose_graph.hpp"

namespace gelslam {

struct LoopConsistencyOptions {
  /// Two ways to measure one motion contradict each other when they differ by more than this, in standard
  /// deviations of what their edges promise together. Wide: what registrations get wrong in common is not in
  /// their information.
  double max_mismatch = 9.0;
  double gradient_scale_sigma =
      0.1;  ///< what a common gradient scale may make of all edges is no contradiction
};

/// Which edges may shape the map; one flag per edge, always true for odometry. A loop has to agree with the
/// odometry between its ends and with most of the loops beside it: each pair closes a cycle, whose error is
/// judged by its covariance (pairwise consistency; Mangelson et al., ICRA 2018). Pieces that odometry does
/// not join (trials) are joined by the largest set of loops that agree with each other, if it outnumbers
/// every other and is evidence enough: one loop that is not `tentative`, or two that share no keyframe. Until
/// then their loops wait, with the flag false. Depends on the edges' order only to settle ties. Throws Error
/// for options that make no sense; what an edge holds is checked by solve_pose_graph().
std::vector<bool> consistent_edges(const std::vector<PoseGraphEdge>& edges,
                                   const LoopConsistencyOptions& options);

}  // namespace gelslam
