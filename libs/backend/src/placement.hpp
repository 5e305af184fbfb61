#pragma once

#include <vector>

#include "edge_residual.hpp"

namespace gelslam::backend::detail {

/// Puts the pieces of a graph in place before it is solved. A piece is a set of nodes joined by odometry that
/// their initial poses agree with; inside it the initial poses are kept. Starting from the piece with the
/// smallest node of each component, the others are joined one by one, best linked first, by the rigid motion
/// that most of their links agree with; where they already agree with the initial poses, nothing moves.
/// Robust against a false loop as long as a piece has more true links than false ones. Source: own.
void place_pieces(const std::vector<WhitenedEdge>& edges, std::vector<NodeState>& nodes);

}  // namespace gelslam::backend::detail
