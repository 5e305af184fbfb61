#include "dual_mesher.hpp"

#include <array>

#include "block_mesher.hpp"
#include "block_sums.hpp"
#include "parallel.hpp"

namespace gelslam::fusion::detail {
namespace {

class DualMesher {
 public:
  DualMesher(const BlockGrid& grid, const Field& field, float voxel_size_mm, int threads)
      : grid_(grid), field_(field), voxel_(voxel_size_mm), threads_(threads) {}

  Mesh run() {
    const std::size_t n = grid_.blocks().size();
    distances_.resize(n);
    parts_.resize(n);
    triangles_.resize(n);
    parallel_for(n, threads_, [&](std::size_t b) { sample(b); });
    parallel_for(n, threads_, [&](std::size_t b) { place(b); });
    std::vector<std::vector<float>>().swap(distances_);
    first_vertex_.push_back(0);
    for (const BlockSurface& part : parts_) {
      first_vertex_.push_back(first_vertex_.back() + static_cast<int>(part.positions.size()));
    }
    parallel_for(n, threads_, [&](std::size_t b) { join(b); });
    return collect();
  }

 private:
  BlockLattice lattice(std::size_t b) const { return {grid_.blocks()[b].first_voxel, voxel_}; }

  /// Index of a neighbor, or -1; `direction` 1 for upper ones, -1 for lower ones.
  int neighbor(std::size_t b, int n, int direction) const {
    if (n == 0) return static_cast<int>(b);
    const Eigen::Vector3i step(n & 1, (n >> 1) & 1, n >> 2);
    return grid_.find(grid_.blocks()[b].first_voxel / block_edge + direction * step);
  }

  void sample(std::size_t b) {
    thread_local BlockSums sums;
    sample_block(lattice(b), grid_.blocks()[b].patches, field_, sums, distances_[b]);
  }

  void place(std::size_t b) {
    std::array<const std::vector<float>*, block_neighbors> upper{};
    for (int n = 0; n < block_neighbors; ++n) {
      const int at = neighbor(b, n, 1);
      if (at >= 0) upper[static_cast<std::size_t>(n)] = &distances_[static_cast<std::size_t>(at)];
    }
    place_vertices(lattice(b), upper, grid_.blocks()[b].patches, field_, parts_[b]);
  }

  void join(std::size_t b) {
    if (parts_[b].cells.empty()) return;
    std::array<const BlockSurface*, block_neighbors> lower{};
    std::array<int, block_neighbors> first{};
    for (std::size_t n = 0; n < block_neighbors; ++n) {
      const int at = neighbor(b, static_cast<int>(n), -1);
      if (at < 0) continue;
      lower[n] = &parts_[static_cast<std::size_t>(at)];
      first[n] = first_vertex_[static_cast<std::size_t>(at)];
    }
    for (const NamedTriangle& t : join_vertices(lower)) {
      const auto global = [&](std::size_t c) {
        return first[static_cast<std::size_t>(t[c].neighbor)] + t[c].vertex;
      };
      triangles_[b].emplace_back(global(0), global(1), global(2));
    }
  }

  Mesh collect() {
    Mesh mesh;
    const std::size_t vertices = static_cast<std::size_t>(first_vertex_.back());
    mesh.vertices_mm.reserve(vertices);
    mesh.normals.reserve(vertices);
    mesh.confidence.reserve(vertices);
    for (std::size_t b = 0; b < parts_.size(); ++b) {
      BlockSurface& part = parts_[b];
      mesh.vertices_mm.insert(mesh.vertices_mm.end(), part.positions.begin(), part.positions.end());
      mesh.normals.insert(mesh.normals.end(), part.normals.begin(), part.normals.end());
      mesh.confidence.insert(mesh.confidence.end(), part.weights.begin(), part.weights.end());
      mesh.triangles.insert(mesh.triangles.end(), triangles_[b].begin(), triangles_[b].end());
      part = {};
    }
    return mesh;
  }

  const BlockGrid& grid_;
  const Field& field_;
  float voxel_;
  int threads_;
  std::vector<std::vector<float>> distances_;
  std::vector<BlockSurface> parts_;
  std::vector<std::vector<Eigen::Vector3i>> triangles_;
  std::vector<int> first_vertex_;  ///< number of vertices in the blocks before, and of all
};

}  // namespace

Mesh extract_zero_set(const BlockGrid& grid, const Field& field, float voxel_size_mm, int threads) {
  return DualMesher(grid, field, voxel_size_mm, threads).run();
}

}  // namespace gelslam::fusion::detail
