#pragma once

#include <vector>

#include "gelslam/backend/pose_graph.hpp"

namespace gelslam {

/// Which edges may shape the map; one flag per edge, always true for odometry. A loop has to agree with the
/// odometry between its ends and with most of the loops beside it: each pair closes a cycle, whose error is
/// judged by its covariance (pairwise consistency; Mangelson et al., ICRA 2018). What a gradient scale of
/// 1 +- `gradient_scale_sigma`, common to all edges, explains is no contradiction. Trials, which odometry
/// does not join, are joined by the largest set of loops that agree with each other, if it outnumbers every
/// other and is evidence enough: one loop that is not `tentative`, or two that share no keyframe. Until then
/// their loops wait, with the flag false. Depends on the edges' order only to break ties. Throws Error for a
/// negative sigma; what an edge holds is checked by solve_pose_graph().
std::vector<bool> consistent_edges(const std::vector<PoseGraphEdge>& edges, double gradient_scale_sigma);

}  // namespace gelslam
