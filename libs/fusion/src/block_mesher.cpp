// Meshes the zero set of the fused distance field by dual contouring on sparse blocks of voxels (Ju et al.,
// SIGGRAPH 2002, with vertices from averaged crossings and the observed normals instead of a QEF).
//
// Each cell whose eight corners are observed and differ in sign gets one vertex per closed cycle of crossed
// edges (cell_cycles.cpp), so that two sheets that pass one cell have vertices of their own. A vertex begins
// at the mean of its edge crossings and moves once along the observed normal onto the zero set, but not out
// of its cell. Each edge between corners of different sign joins the vertices of the four cells around it to
// two triangles, split at the shorter diagonal.
//
// The mesh ends where the largest weight falls to Field::end_weight(); vertices near that line are moved onto
// it along the surface. Quads whose normal disagrees with the observed normals are steps between different
// sides of the object, at places that were not touched, and are left out. Limitation: features smaller than a
// voxel are lost.

#include "block_mesher.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

namespace gelslam::fusion::detail {
namespace {

/// A block's distances and those of the upper neighbors' first voxels.
using PaddedDistances = std::array<float, (kBlockEdge + 1) * (kBlockEdge + 1) * (kBlockEdge + 1)>;

Eigen::Vector3i lowest_voxel(int cell) {
  return {cell % kBlockEdge, cell / kBlockEdge % kBlockEdge, cell / (kBlockEdge * kBlockEdge)};
}

/// Returns the block's distances and those of the first layer of its upper neighbors.
PaddedDistances padded(const std::array<const std::vector<float>*, kBlockNeighbors>& upper) {
  PaddedDistances out;
  out.fill(kUnobserved);
  for (int n = 0; n < kBlockNeighbors; ++n) {
    const std::vector<float>* from = upper[static_cast<std::size_t>(n)];
    if (!from || from->empty()) continue;
    const Eigen::Vector3i step(n & 1, (n >> 1) & 1, n >> 2);
    const Eigen::Vector3i size = (step.array() == 1).select(Eigen::Array3i::Ones(), kBlockEdge);
    for (int z = 0; z < size.z(); ++z) {
      for (int y = 0; y < size.y(); ++y) {
        const Eigen::Vector3i row(0, y, z);
        std::copy_n(
            from->begin() + static_cast<std::ptrdiff_t>(voxel_index(row, kBlockEdge)), size.x(),
            out.begin() + static_cast<std::ptrdiff_t>(voxel_index(row + step * kBlockEdge, kBlockEdge + 1)));
      }
    }
  }
  return out;
}

class VertexPlacer {
 public:
  VertexPlacer(const BlockLattice& lattice, const PatchList& patches, const Field& field, BlockSurface& out)
      : lattice_(lattice), patches_(patches), field_(field), out_(out) {}

  void add_cell(int cell, const std::array<float, 8>& corner, std::uint8_t outside) {
    out_.cells.push_back({cell, outside, static_cast<int>(out_.positions.size())});
    const CellCycles& cycles = cell_cycles(outside);
    std::array<Eigen::Vector3f, 4> sum;
    std::array<int, 4> count{};
    sum.fill(Eigen::Vector3f::Zero());
    for (std::size_t e = 0; e < 12; ++e) {
      if (cycles.of_edge[e] < 0) continue;
      const CellEdge& edge = cell_edges()[e];
      const float from = corner[static_cast<std::size_t>(edge.from)],
                  to = corner[static_cast<std::size_t>(edge.to)];
      Eigen::Vector3f crossing(static_cast<float>(edge.from & 1), static_cast<float>((edge.from >> 1) & 1),
                               static_cast<float>(edge.from >> 2));
      crossing[static_cast<int>(e) / 4] += from / (from - to);
      const std::size_t cycle = static_cast<std::size_t>(cycles.of_edge[e]);
      sum[cycle] += crossing;
      ++count[cycle];
    }
    const Eigen::Vector3f corner_mm = lattice_.position(lattice_.first_voxel + lowest_voxel(cell));
    for (std::size_t cycle = 0; cycle < static_cast<std::size_t>(cycles.count); ++cycle)
      add_vertex(corner_mm, sum[cycle] / static_cast<float>(count[cycle]));
  }

 private:
  /// Adds a vertex after moving it along the observed normal onto the zero set, limited to its cell.
  void add_vertex(const Eigen::Vector3f& corner_mm, const Eigen::Vector3f& inside_cell) {
    const float voxel = lattice_.voxel_size_mm;
    FieldValue value;
    Eigen::Vector3f p = corner_mm + voxel * inside_cell;
    bool observed = field_.evaluate(p, patches_, scratch_, value);
    if (observed) {  // A second step would move it by less than a micrometer.
      p -= value.distance_mm * value.normal;
      p = p.cwiseMax(corner_mm).cwiseMin(Eigen::Vector3f(corner_mm.array() + voxel));
      observed = field_.evaluate(p, patches_, scratch_, value);
    }
    const bool is_rim = observed && move_to_rim(value, p);
    if (is_rim) {
      observed = field_.evaluate(p, patches_, scratch_, value);
      if (observed) p -= value.distance_mm * value.normal;
    }
    out_.is_rim.push_back(is_rim);
    out_.positions.push_back(p);
    out_.normals.push_back(observed ? value.normal : Eigen::Vector3f::Zero());
    out_.weights.push_back(observed ? value.weight : 0.0f);
    out_.keyframes.push_back(observed ? value.keyframe : 0);
  }

  /// The mesh would end in steps of whole voxels. Vertices beyond the line where it ends (the rim), or close
  /// to it, are therefore moved along the surface to where the weight is that of the rim. Returns false if
  /// `p` lies inside.
  bool move_to_rim(const FieldValue& at, Eigen::Vector3f& p) const {
    // In voxels: the distance inside the rim up to which vertices are moved, and the largest distance by
    // which one is moved. Steps have half a voxel on both sides of the rim.
    constexpr float kNear = 0.5f, kFarthest = 1.0f;
    const float voxel = lattice_.voxel_size_mm, step = 0.25f * voxel;
    if (at.best > 2 * field_.end_weight()) return false;
    Eigen::Vector3f rise;
    for (int axis = 0; axis < 3; ++axis) {
      const Eigen::Vector3f along = step * Eigen::Vector3f::Unit(axis);
      rise[axis] =
          (field_.log_weight(p + along, patches_) - field_.log_weight(p - along, patches_)) / (2 * step);
    }
    rise -= rise.dot(at.normal) * at.normal;
    const float steepness = std::max(rise.norm(), 1e-6f);
    const float inward = (Field::log_weight(field_.end_weight()) - Field::log_weight(at.best)) / steepness;
    if (inward < -kNear * voxel) return false;
    p += std::min(inward, kFarthest * voxel) / steepness * rise;
    return true;
  }

  const BlockLattice& lattice_;
  const PatchList& patches_;
  const Field& field_;
  BlockSurface& out_;
  std::vector<Observation> scratch_;
};

class VertexJoiner {
 public:
  explicit VertexJoiner(const std::array<const BlockSurface*, kBlockNeighbors>& lower) : lower_(lower) {}

  std::vector<NamedTriangle> run() {
    for (const ActiveCell& cell : lower_[0]->cells)
      for (int axis = 0; axis < 3; ++axis) add_edge(cell, axis);
    return std::move(triangles_);
  }

 private:
  static constexpr VertexName kNowhere{-1, -1};

  void add_edge(const ActiveCell& cell, int axis) {
    const bool from_outside = (cell.outside & 1) != 0;
    const bool to_outside = ((cell.outside >> (1 << axis)) & 1) != 0;
    if (from_outside == to_outside) return;
    const Eigen::Vector3i voxel = lowest_voxel(cell.cell);
    const Eigen::Vector3i back_b = Eigen::Vector3i::Unit((axis + 1) % 3);
    const Eigen::Vector3i back_c = Eigen::Vector3i::Unit((axis + 2) % 3);
    // The quad is counter-clockwise as seen from the far end of the edge.
    std::array<VertexName, 4> quad{vertex_at(voxel, 4 * axis), vertex_at(voxel - back_b, 4 * axis + 1),
                                   vertex_at(voxel - back_b - back_c, 4 * axis + 3),
                                   vertex_at(voxel - back_c, 4 * axis + 2)};
    for (const VertexName& v : quad)
      if (v.neighbor < 0) return;
    if (from_outside) std::reverse(quad.begin(), quad.end());
    add_quad(quad);
  }

  /// Returns the vertex of the cycle that contains `edge` of the cell at `voxel`. The cell may lie in a lower
  /// neighbor, with coordinate -1.
  VertexName vertex_at(Eigen::Vector3i voxel, int edge) const {
    int neighbor = 0;
    for (int axis = 0; axis < 3; ++axis) {
      if (voxel[axis] >= 0) continue;
      voxel[axis] += kBlockEdge;
      neighbor |= 1 << axis;
    }
    const BlockSurface* block = lower_[static_cast<std::size_t>(neighbor)];
    if (!block) return kNowhere;
    const int cell = static_cast<int>(voxel_index(voxel, kBlockEdge));
    const auto found = std::lower_bound(block->cells.begin(), block->cells.end(), cell,
                                        [](const ActiveCell& a, int wanted) { return a.cell < wanted; });
    if (found == block->cells.end() || found->cell != cell) return kNowhere;
    const int cycle = cell_cycles(found->outside).of_edge[static_cast<std::size_t>(edge)];
    const int vertex = found->first_vertex + cycle;
    if (cycle < 0 || !(block->weights[static_cast<std::size_t>(vertex)] > 0)) return kNowhere;
    return {neighbor, vertex};
  }

  void add_quad(const std::array<VertexName, 4>& quad) {
    std::array<Eigen::Vector3f, 4> p;
    Eigen::Vector3f observed = Eigen::Vector3f::Zero();
    for (std::size_t i = 0; i < 4; ++i) {
      const BlockSurface& block = *lower_[static_cast<std::size_t>(quad[i].neighbor)];
      p[i] = block.positions[static_cast<std::size_t>(quad[i].vertex)];
      observed += block.normals[static_cast<std::size_t>(quad[i].vertex)];
    }
    // Where the band of one side ends beside another side, the field has a step, and the mesh would get a
    // wall there that was never touched. Its normal does not agree with the observed ones.
    constexpr float kMinAgreement = 0.5f;
    const Eigen::Vector3f across = (p[2] - p[0]).cross(p[3] - p[1]);
    if (across.dot(observed) < kMinAgreement * across.norm() * observed.norm()) return;
    if ((p[2] - p[0]).squaredNorm() <= (p[3] - p[1]).squaredNorm()) {
      add_triangle({quad[0], quad[1], quad[2]});
      add_triangle({quad[0], quad[2], quad[3]});
    } else {
      add_triangle({quad[0], quad[1], quad[3]});
      add_triangle({quad[1], quad[2], quad[3]});
    }
  }

  /// A triangle whose three vertices lie on the rim is left out, because it contains no inner part of the
  /// surface.
  void add_triangle(const NamedTriangle& triangle) {
    const auto is_rim = [&](const VertexName& v) {
      return lower_[static_cast<std::size_t>(v.neighbor)]->is_rim[static_cast<std::size_t>(v.vertex)];
    };
    if (!std::all_of(triangle.begin(), triangle.end(), is_rim)) triangles_.push_back(triangle);
  }

  const std::array<const BlockSurface*, kBlockNeighbors>& lower_;
  std::vector<NamedTriangle> triangles_;
};

}  // namespace

void place_vertices(const BlockLattice& lattice,
                    const std::array<const std::vector<float>*, kBlockNeighbors>& upper,
                    const PatchList& patches, const Field& field, BlockSurface& out) {
  out = {};
  if (!upper[0] || upper[0]->empty()) return;
  const PaddedDistances distances = padded(upper);
  VertexPlacer placer(lattice, patches, field, out);
  for (int cell = 0; cell < kBlockVoxels; ++cell) {
    const Eigen::Vector3i base = lowest_voxel(cell);
    std::array<float, 8> corner;
    unsigned outside = 0;
    bool observed = true;
    for (int c = 0; c < 8; ++c) {
      const float d =
          distances[voxel_index(base + Eigen::Vector3i(c & 1, (c >> 1) & 1, c >> 2), kBlockEdge + 1)];
      corner[static_cast<std::size_t>(c)] = d;
      observed = observed && !std::isnan(d);
      if (d > 0) outside |= 1u << c;
    }
    if (observed && outside != 0 && outside != 255)
      placer.add_cell(cell, corner, static_cast<std::uint8_t>(outside));
  }
}

std::vector<NamedTriangle> join_vertices(const std::array<const BlockSurface*, kBlockNeighbors>& lower) {
  return VertexJoiner(lower).run();
}

}  // namespace gelslam::fusion::detail
