#pragma once

#include <vector>

#include "whitened_graph.hpp"

// What a loop meets, in this order. Before, verify() (registration) has compared its two surfaces.
//   consistent_edges():
//   1. join_trials             loops join two trials if they agree and are evidence enough
//   2. is_supported            the way between a loop's ends says the same
//   solve_pose_graph():
//   3. place_pieces            trials are laid where loops join them
//   4. robust_cost, _weight    a loop that does not fit pulls less
//   5. kernel_widenings        loops that drift has opened wide are closed
//   6. is_outlier              a loop that still does not fit has no weight
namespace gelslam::backend::detail {

/// Places the pieces of a graph before it is solved. A piece is a set of nodes joined by odometry; inside it
/// the initial poses are kept. Starting from the piece with the smallest node of each component, the others
/// are moved rigidly onto one of the loops that lead to them, if more of these hold there than where the
/// piece is.
void place_pieces(const std::vector<WhitenedEdge>& edges, std::vector<NodeState>& nodes);

/// Graduated non-convexity: a robust kernel gives little weight to any loop that drift has opened wide, true
/// or false. Starting from a kernel `widest` times as wide, as wide as the worst loop, and narrowing it, true
/// loops close and false ones lose their weight. (Blake & Zisserman 1987; schedule: own.)
std::vector<double> kernel_widenings(double widest);

/// Beyond kMaxMismatch.
bool is_outlier(EdgeKind kind, double residual);

}  // namespace gelslam::backend::detail
