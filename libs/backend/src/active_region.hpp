#pragma once

#include <vector>

#include "edge_residual.hpp"

namespace gelslam::backend::detail {

/// Nodes that the graph pulls at: those that a Newton step of their own would move by more than a twentieth
/// of their standard deviation (neighbors held), grown by `rings` edges. Nodes already in `region` stay in
/// it. Loops count with their robust weight (Cauchy, `loop_loss_scale`). Returns false when nothing new was
/// found.
bool grow_active_region(const std::vector<WhitenedEdge>& edges, const std::vector<NodeState>& nodes,
                        double loop_loss_scale, int rings, std::vector<bool>& region);

}  // namespace gelslam::backend::detail
