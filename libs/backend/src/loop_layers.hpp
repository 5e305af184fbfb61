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
//   5. kernel_widths           loops that drift has opened wide are closed
//   6. is_outlier              a loop that still does not fit counts no more
namespace gelslam::backend::detail {

/// Places the pieces of a graph before it is solved. A piece is a set of nodes joined by odometry; inside it
/// the initial poses are kept. Starting from the piece with the smallest node of each component, the others
/// are moved rigidly onto the first loop that leads to them, unless they agree with it already. Loops that
/// contradict each other are left out before, by consistent_edges().
void place_pieces(const std::vector<WhitenedEdge>& edges, std::vector<NodeState>& nodes);

/// Graduated non-convexity: a robust kernel gives little weight to any loop that drift has opened wide, true
/// or false. Starting from a kernel as wide as the worst loop and narrowing it, true loops close and false
/// ones lose their weight. (Blake & Zisserman 1987; schedule: own.)
std::vector<double> kernel_widths(double worst_loop, double loop_loss_scale);

/// Beyond kMaxMismatch.
bool is_outlier(EdgeKind kind, double residual);

}  // namespace gelslam::backend::detail
