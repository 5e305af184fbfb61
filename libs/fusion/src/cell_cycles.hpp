#pragma once

#include <array>
#include <cstdint>

namespace gelslam::fusion::detail {

/// A cell's corners are numbered x + 2y + 4z, its edges 4 * axis + b + 2 * c with b and c the edge's position
/// (0 or 1) along the two following axes.
struct CellEdge {
  int from, to;  ///< corners, `to` one step along the axis
};
const std::array<CellEdge, 12>& cell_edges();

/// How the surface passes through a cell: edges that it crosses, joined into closed cycles, one dual vertex
/// for each. Ambiguous faces are cut so that what is inside stays connected; two cells that share a face
/// agree because only the face's corners decide (Nielson, "Dual marching cubes", IEEE Visualization 2004;
/// tables computed here).
struct CellCycles {
  int count = 0;
  std::array<std::int8_t, 12> of_edge;  ///< which cycle each edge belongs to, -1 where not crossed
};

/// `outside`: bit i is set when corner i lies outside.
const CellCycles& cell_cycles(std::uint8_t outside);

}  // namespace gelslam::fusion::detail
