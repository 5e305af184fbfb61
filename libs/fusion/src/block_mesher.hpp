#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <vector>

#include "block_sums.hpp"
#include "field.hpp"

namespace gelslam::fusion::detail {

/// The corners of a cell are numbered x + 2y + 4z. Its edges are numbered 4 * axis + b + 2 * c, where b and c
/// (0 or 1) are the edge's position along the two following axes.
struct CellEdge {
  int from, to;  ///< corners, `to` one step along the axis
};
const std::array<CellEdge, 12>& cell_edges();

/// How the surface passes through a cell: the edges that it crosses, joined to closed cycles with one dual
/// vertex each. Ambiguous faces are resolved so that the inside stays connected. Two cells that share a face
/// resolve it in the same way, because only the corners of the face decide (Nielson, "Dual marching cubes",
/// IEEE Visualization 2004; the tables are computed here).
struct CellCycles {
  int count = 0;
  std::array<std::int8_t, 12> of_edge;  ///< which cycle each edge belongs to, -1 where not crossed
};

/// `outside`: bit i is set when corner i lies outside.
const CellCycles& cell_cycles(std::uint8_t outside);

/// A cell through which the surface passes.
struct ActiveCell {
  int cell = 0;              ///< voxel_index of its lowest corner in its block
  std::uint8_t outside = 0;  ///< signs of its corners
  int first_vertex = 0;      ///< Index of its first vertex in the block; there is one vertex per cycle.

  bool operator==(const ActiveCell&) const = default;
};

/// The vertices in a block's cells.
struct BlockSurface {
  std::vector<ActiveCell> cells;  ///< ascending by cell
  std::vector<Eigen::Vector3f> positions, normals;
  std::vector<float> weights;  ///< 0 for a vertex at a point that was not observed; it is not used.
  std::vector<int> keyframes;  ///< Keyframe with the largest weight at the vertex.
  std::vector<bool> is_rim;    ///< True for a vertex on the line where the mesh ends.

  bool operator==(const BlockSurface&) const = default;
};

/// Finds the cells of a block through which the surface passes, and their vertices on the zero set of the
/// field. Only cells whose corners were all observed are used. `upper` holds the distances of the block (0)
/// and of its upper neighbors; entries may be null or empty.
void place_vertices(const BlockLattice& lattice,
                    const std::array<const std::vector<float>*, kBlockNeighbors>& upper,
                    const PatchList& patches, const Field& field, BlockSurface& out);

/// A vertex of the block (0) or of one of its lower neighbors.
struct VertexName {
  int neighbor = 0;
  int vertex = 0;
};
using NamedTriangle = std::array<VertexName, 3>;

/// Returns the triangles of a block: those around every crossed edge that begins at one of its voxels,
/// counter-clockwise as seen from outside. `lower` holds the block (0, never null) and its lower neighbors.
std::vector<NamedTriangle> join_vertices(const std::array<const BlockSurface*, kBlockNeighbors>& lower);

}  // namespace gelslam::fusion::detail
