#include "dual_mesher.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "cell_cycles.hpp"
#include "parallel.hpp"

namespace gelslam::fusion::detail {
namespace {

constexpr float unobserved = std::numeric_limits<float>::quiet_NaN();

std::size_t voxel_index(const Eigen::Vector3i& local, int edge) {
  return static_cast<std::size_t>((local.z() * edge + local.y()) * edge + local.x());
}

/// A cell the surface passes through.
struct ActiveCell {
  int cell = 0;              ///< voxel_index of its lowest corner in its block
  std::uint8_t outside = 0;  ///< signs of its corners
  int first_vertex = 0;      ///< of the block's vertices: one for each cycle
};

struct BlockMesh {
  std::vector<ActiveCell> cells;  ///< ascending by cell
  std::vector<Eigen::Vector3f> positions, normals;
  std::vector<float> weights;  ///< 0: the vertex fell where nothing was observed, and is not used
  std::vector<Eigen::Vector3i> triangles;
  int first_vertex = 0;  ///< number of vertices in the blocks before
};

class DualMesher {
 public:
  DualMesher(const BlockGrid& grid, const Field& field, float voxel_size_mm, int threads)
      : grid_(grid), field_(field), voxel_(voxel_size_mm), threads_(threads) {}

  Mesh run() {
    const std::size_t n = grid_.blocks().size();
    distances_.resize(n);
    parts_.resize(n);
    parallel_for(n, threads_, [&](std::size_t b) { sample(b); });
    parallel_for(n, threads_, [&](std::size_t b) { place_vertices(b); });
    std::vector<std::vector<float>>().swap(distances_);
    int vertices = 0;
    for (BlockMesh& part : parts_) {
      part.first_vertex = vertices;
      vertices += static_cast<int>(part.positions.size());
    }
    parallel_for(n, threads_, [&](std::size_t b) { join_vertices(b); });
    return collect(static_cast<std::size_t>(vertices));
  }

 private:
  Eigen::Vector3f position(const Eigen::Vector3i& voxel) const { return voxel.cast<float>() * voxel_; }

  void sample(std::size_t b) {
    const Block& block = grid_.blocks()[b];
    std::vector<float>& distances = distances_[b];
    distances.assign(block_voxels, unobserved);
    std::vector<Observation> scratch;
    FieldValue value;
    std::size_t i = 0;
    for (int z = 0; z < block_edge; ++z) {
      for (int y = 0; y < block_edge; ++y) {
        for (int x = 0; x < block_edge; ++x, ++i) {
          const Eigen::Vector3f p = position(block.first_voxel + Eigen::Vector3i(x, y, z));
          if (field_.evaluate(p, block.patches, scratch, value)) distances[i] = value.distance_mm;
        }
      }
    }
  }

  /// The block's distances and those of the first layer of its upper neighbours: 9x9x9.
  void with_neighbours(std::size_t b, std::vector<float>& out) const {
    constexpr int edge = block_edge + 1;
    out.assign(edge * edge * edge, unobserved);
    const Eigen::Vector3i coordinate = grid_.blocks()[b].first_voxel / block_edge;
    for (int n = 0; n < 8; ++n) {
      const Eigen::Vector3i step(n & 1, (n >> 1) & 1, n >> 2);
      const int neighbour = n == 0 ? static_cast<int>(b) : grid_.find(coordinate + step);
      if (neighbour < 0) continue;
      const std::vector<float>& from = distances_[static_cast<std::size_t>(neighbour)];
      const Eigen::Vector3i size = (step.array() == 1).select(Eigen::Array3i::Ones(), block_edge);
      for (int z = 0; z < size.z(); ++z) {
        for (int y = 0; y < size.y(); ++y) {
          for (int x = 0; x < size.x(); ++x) {
            const Eigen::Vector3i local(x, y, z);
            out[voxel_index(local + step * block_edge, edge)] = from[voxel_index(local, block_edge)];
          }
        }
      }
    }
  }

  void place_vertices(std::size_t b) {
    constexpr int edge = block_edge + 1;
    thread_local std::vector<float> distances;
    with_neighbours(b, distances);
    const Block& block = grid_.blocks()[b];
    BlockMesh& part = parts_[b];
    for (int cell = 0; cell < block_voxels; ++cell) {
      const Eigen::Vector3i base(cell % block_edge, cell / block_edge % block_edge,
                                 cell / (block_edge * block_edge));
      std::array<float, 8> corner;
      unsigned outside = 0;
      bool observed = true;
      for (int c = 0; c < 8; ++c) {
        const float d = distances[voxel_index(base + Eigen::Vector3i(c & 1, (c >> 1) & 1, c >> 2), edge)];
        corner[static_cast<std::size_t>(c)] = d;
        observed = observed && !std::isnan(d);
        if (d > 0) outside |= 1u << c;
      }
      if (!observed || outside == 0 || outside == 255) continue;
      part.cells.push_back(
          {cell, static_cast<std::uint8_t>(outside), static_cast<int>(part.positions.size())});
      add_cell_vertices(block, base, corner, static_cast<std::uint8_t>(outside), part);
    }
  }

  void add_cell_vertices(const Block& block, const Eigen::Vector3i& base, const std::array<float, 8>& corner,
                         std::uint8_t outside, BlockMesh& part) const {
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
    for (std::size_t cycle = 0; cycle < static_cast<std::size_t>(cycles.count); ++cycle) {
      const Eigen::Vector3f inside_cell = sum[cycle] / static_cast<float>(count[cycle]);
      add_vertex(block, position(block.first_voxel + base), inside_cell, part);
    }
  }

  /// Moves the vertex along the observed normal onto the zero set, but not out of its cell.
  void add_vertex(const Block& block, const Eigen::Vector3f& corner_mm, const Eigen::Vector3f& inside_cell,
                  BlockMesh& part) const {
    constexpr int steps = 1;  // a second one moves it by less than a micrometre
    thread_local std::vector<Observation> scratch;
    FieldValue value;
    Eigen::Vector3f p = corner_mm + voxel_ * inside_cell;
    bool observed = field_.evaluate(p, block.patches, scratch, value);
    for (int step = 0; observed && step < steps; ++step) {
      p -= value.distance_mm * value.normal;
      p = p.cwiseMax(corner_mm).cwiseMin(Eigen::Vector3f(corner_mm.array() + voxel_));
      observed = field_.evaluate(p, block.patches, scratch, value);
    }
    part.positions.push_back(p);
    part.normals.push_back(observed ? value.normal : Eigen::Vector3f::Zero());
    part.weights.push_back(observed ? value.weight : 0.0f);
  }

  /// Global index of the vertex that crosses `edge` of the cell at `voxel`, or -1.
  int vertex_at(const Eigen::Vector3i& voxel, int edge, std::size_t home) const {
    const auto floor_div = [](int a) {
      return a >= 0 ? a / block_edge : -((block_edge - 1 - a) / block_edge);
    };
    const Eigen::Vector3i coordinate = voxel.unaryExpr(floor_div);
    const bool at_home = coordinate * block_edge == grid_.blocks()[home].first_voxel;
    const int b = at_home ? static_cast<int>(home) : grid_.find(coordinate);
    if (b < 0) return -1;
    const BlockMesh& part = parts_[static_cast<std::size_t>(b)];
    const int cell = static_cast<int>(voxel_index(voxel - coordinate * block_edge, block_edge));
    const auto found = std::lower_bound(part.cells.begin(), part.cells.end(), cell,
                                        [](const ActiveCell& a, int wanted) { return a.cell < wanted; });
    if (found == part.cells.end() || found->cell != cell) return -1;
    const int cycle = cell_cycles(found->outside).of_edge[static_cast<std::size_t>(edge)];
    const int local = found->first_vertex + cycle;
    if (cycle < 0 || !(part.weights[static_cast<std::size_t>(local)] > 0)) return -1;
    return part.first_vertex + local;
  }

  const Eigen::Vector3f& position_of(int vertex, std::size_t home,
                                     const std::vector<Eigen::Vector3f> BlockMesh::*what) const {
    // Vertices of one quadrilateral lie in at most four neighbouring blocks; the home block is the likely
    // one.
    const BlockMesh& guess = parts_[home];
    const int local = vertex - guess.first_vertex;
    if (local >= 0 && local < static_cast<int>((guess.*what).size()))
      return (guess.*what)[static_cast<std::size_t>(local)];
    const auto after = std::upper_bound(parts_.begin(), parts_.end(), vertex,
                                        [](int v, const BlockMesh& part) { return v < part.first_vertex; });
    const BlockMesh& part = *std::prev(after);
    return (part.*what)[static_cast<std::size_t>(vertex - part.first_vertex)];
  }

  void join_vertices(std::size_t b) {
    const Block& block = grid_.blocks()[b];
    for (const ActiveCell& cell : parts_[b].cells) {
      const Eigen::Vector3i base(cell.cell % block_edge, cell.cell / block_edge % block_edge,
                                 cell.cell / (block_edge * block_edge));
      for (int axis = 0; axis < 3; ++axis) {
        const bool from_outside = (cell.outside & 1) != 0;
        const bool to_outside = ((cell.outside >> (1 << axis)) & 1) != 0;
        if (from_outside == to_outside) continue;
        const Eigen::Vector3i voxel = block.first_voxel + base;
        const Eigen::Vector3i back_b = Eigen::Vector3i::Unit((axis + 1) % 3);
        const Eigen::Vector3i back_c = Eigen::Vector3i::Unit((axis + 2) % 3);
        // Counter-clockwise seen from the edge's far end.
        std::array<int, 4> quad{vertex_at(voxel, 4 * axis, b), vertex_at(voxel - back_b, 4 * axis + 1, b),
                                vertex_at(voxel - back_b - back_c, 4 * axis + 3, b),
                                vertex_at(voxel - back_c, 4 * axis + 2, b)};
        if (*std::min_element(quad.begin(), quad.end()) < 0) continue;
        if (from_outside) std::reverse(quad.begin(), quad.end());
        add_quad(quad, b);
      }
    }
  }

  void add_quad(const std::array<int, 4>& quad, std::size_t b) {
    std::array<Eigen::Vector3f, 4> p;
    Eigen::Vector3f observed = Eigen::Vector3f::Zero();
    for (std::size_t i = 0; i < 4; ++i) {
      p[i] = position_of(quad[i], b, &BlockMesh::positions);
      observed += position_of(quad[i], b, &BlockMesh::normals);
    }
    // Where one side's band ends beside another's there is a step in the field, and a wall that nobody
    // touched: its normal has nothing to do with the observed ones.
    constexpr float least_agreement = 0.5f;
    const Eigen::Vector3f across = (p[2] - p[0]).cross(p[3] - p[1]);
    if (across.dot(observed) < least_agreement * across.norm() * observed.norm()) return;
    const bool split_02 = (p[2] - p[0]).squaredNorm() <= (p[3] - p[1]).squaredNorm();
    std::vector<Eigen::Vector3i>& out = parts_[b].triangles;
    if (split_02) {
      out.emplace_back(quad[0], quad[1], quad[2]);
      out.emplace_back(quad[0], quad[2], quad[3]);
    } else {
      out.emplace_back(quad[0], quad[1], quad[3]);
      out.emplace_back(quad[1], quad[2], quad[3]);
    }
  }

  Mesh collect(std::size_t vertices) {
    Mesh mesh;
    mesh.vertices_mm.reserve(vertices);
    mesh.normals.reserve(vertices);
    mesh.confidence.reserve(vertices);
    for (BlockMesh& part : parts_) {
      mesh.vertices_mm.insert(mesh.vertices_mm.end(), part.positions.begin(), part.positions.end());
      mesh.normals.insert(mesh.normals.end(), part.normals.begin(), part.normals.end());
      mesh.confidence.insert(mesh.confidence.end(), part.weights.begin(), part.weights.end());
      mesh.triangles.insert(mesh.triangles.end(), part.triangles.begin(), part.triangles.end());
      part = BlockMesh{};
    }
    return mesh;
  }

  const BlockGrid& grid_;
  const Field& field_;
  float voxel_;
  int threads_;
  std::vector<std::vector<float>> distances_;
  std::vector<BlockMesh> parts_;
};

}  // namespace

Mesh extract_zero_set(const BlockGrid& grid, const Field& field, float voxel_size_mm, int threads) {
  return DualMesher(grid, field, voxel_size_mm, threads).run();
}

}  // namespace gelslam::fusion::detail
