#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <vector>

#include "block_sums.hpp"
#include "field.hpp"

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

/// A cell the surface passes through.
struct ActiveCell {
  int cell = 0;              ///< voxel_index of its lowest corner in its block
  std::uint8_t outside = 0;  ///< signs of its corners
  int first_vertex = 0;      ///< of the block's vertices: one for each cycle

  bool operator==(const ActiveCell&) const = default;
};

/// The vertices in a block's cells.
struct BlockSurface {
  std::vector<ActiveCell> cells;  ///< ascending by cell
  std::vector<Eigen::Vector3f> positions, normals;
  std::vector<float> weights;  ///< 0: the vertex fell where nothing was observed, and is not used
  std::vector<int> keyframes;  ///< the one that sees the vertex best
  std::vector<bool> is_rim;    ///< moved to where the mesh ends

  bool operator==(const BlockSurface&) const = default;
};

/// Finds the cells of a block that the surface passes through and their vertices, moved onto the field's zero
/// set. `upper`: distances of the block (0) and of its upper neighbors; null or empty where there are none.
/// A cell counts when all its corners were observed.
void place_vertices(const BlockLattice& lattice,
                    const std::array<const std::vector<float>*, kBlockNeighbors>& upper,
                    const PatchList& patches, const Field& field, BlockSurface& out);

/// A vertex of the block (0) or of one of its lower neighbors.
struct VertexName {
  int neighbor = 0;
  int vertex = 0;
};
using NamedTriangle = std::array<VertexName, 3>;

/// The triangles that belong to a block: around every crossed lattice edge that begins at one of its voxels,
/// counter-clockwise seen from outside. `lower`: the block (0, never null) and its lower neighbors.
std::vector<NamedTriangle> join_vertices(const std::array<const BlockSurface*, kBlockNeighbors>& lower);

}  // namespace gelslam::fusion::detail
