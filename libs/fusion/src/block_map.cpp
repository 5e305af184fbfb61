// The voxel blocks of a fused mesh and how changes of patches propagate through them (not in the paper).
//
// A patch is listed in every block that it passes. A block whose list has changed is sampled again; if it
// keeps sums (BlockSums), patches are added and removed exactly, otherwise all its patches are evaluated.
// Vertices are placed again in the blocks whose distances have changed and in their lower neighbors, and
// triangles where vertices have changed. The result depends only on the listed patches, not on the order of
// changes.

#include "block_map.hpp"

#include <cmath>
#include <iterator>
#include <span>

#include "gelslam/core/index.hpp"
#include "gelslam/core/parallel.hpp"

namespace gelslam::fusion::detail {
namespace {

/// Number of blocks processed together in mesh_all(). Their distances take 8 MB, and the threads synchronize
/// once in some tenths of a second.
constexpr std::size_t kBlocksAtOnce = 4096;

bool is_before(const PatchPtr& a, const PatchPtr& b) {
  return a->keyframe() != b->keyframe() ? a->keyframe() < b->keyframe() : a < b;
}

PatchList opened(const std::vector<PatchPtr>& patches) {
  PatchList list;
  for (const PatchPtr& p : patches) list.push_back(p->opened());
  return list;
}

std::vector<PatchPtr> difference(const std::vector<PatchPtr>& a, const std::vector<PatchPtr>& b) {
  std::vector<PatchPtr> result;
  std::set_difference(a.begin(), a.end(), b.begin(), b.end(), std::back_inserter(result), is_before);
  return result;
}

bool differs(float a, float b) { return !(a == b || (std::isnan(a) && std::isnan(b))); }

/// Returns a bit mask in which bit n is set if lower neighbor n depends on a changed distance, because its
/// cells use the lowest layers of this block's voxels.
unsigned neighbors_that_see(const std::vector<float>& before, const std::vector<float>& after) {
  unsigned seen = 0;
  const auto at = [](const std::vector<float>& d, std::size_t i) { return d.empty() ? std::nanf("") : d[i]; };
  for (int i = 0; i < kBlockVoxels; ++i) {
    const int lowest = (i % kBlockEdge == 0 ? 1 : 0) | (i / kBlockEdge % kBlockEdge == 0 ? 2 : 0) |
                       (i < kBlockEdge * kBlockEdge ? 4 : 0);
    const std::size_t voxel = static_cast<std::size_t>(i);
    if (lowest == 0 || !differs(at(before, voxel), at(after, voxel))) continue;
    for (int n = 1; n < kBlockNeighbors; ++n)
      if ((n & lowest) == n) seen |= 1u << n;
  }
  return seen;
}

void drop_if_unobserved(std::vector<float>& distances) {
  if (std::all_of(distances.begin(), distances.end(), [](float d) { return std::isnan(d); }))
    std::vector<float>().swap(distances);
}

/// Returns a block's mesh, which contains only the vertices that its triangles use.
MeshBlock compact(std::int64_t key, const std::vector<NamedTriangle>& triangles,
                  const std::array<const BlockSurface*, kBlockNeighbors>& lower) {
  MeshBlock block{key, {}, {}};
  std::array<std::vector<int>, kBlockNeighbors> new_index;
  const auto rename = [&](const VertexName& name) {
    const BlockSurface& from = *lower[static_cast<std::size_t>(name.neighbor)];
    std::vector<int>& indices = new_index[static_cast<std::size_t>(name.neighbor)];
    indices.resize(from.positions.size(), -1);
    const std::size_t v = static_cast<std::size_t>(name.vertex);
    if (indices[v] < 0) {
      indices[v] = static_cast<int>(block.mesh.vertices_mm.size());
      block.mesh.vertices_mm.push_back(from.positions[v]);
      block.mesh.normals.push_back(from.normals[v]);
      block.mesh.confidence.push_back(from.weights[v]);
      block.keyframe.push_back(from.keyframes[v]);
    }
    return indices[v];
  };
  block.mesh.triangles.reserve(triangles.size());
  for (const NamedTriangle& t : triangles) {
    const int a = rename(t[0]), b = rename(t[1]), c = rename(t[2]);
    block.mesh.triangles.emplace_back(a, b, c);
  }
  return MeshBlock(block);  // The copy frees spare capacity.
}

}  // namespace

void BlockMap::mark_dirty(std::int64_t key, Block& block) {
  if (!block.dirty) dirty_.push_back(key);
  block.dirty = true;
}

void BlockMap::list(const PlacedPatch& placed) {
  for (const PassedBlock& passed : placed.blocks) {
    Block& block = blocks_[passed.key];
    const auto after = std::upper_bound(
        block.listed.begin(), block.listed.end(), placed.patch,
        [](const PatchPtr& patch, const Listing& listing) { return is_before(patch, listing.patch); });
    block.listed.insert(after, {placed.patch, passed.near});
    mark_dirty(passed.key, block);
  }
}

void BlockMap::unlist(const PlacedPatch& placed) {
  for (const PassedBlock& passed : placed.blocks) {
    Block& block = blocks_.at(passed.key);
    std::erase_if(block.listed, [&](const Listing& listing) { return listing.patch == placed.patch; });
    mark_dirty(passed.key, block);
  }
}

std::vector<std::int64_t> BlockMap::take_dirty(std::size_t most) {
  struct Entry {
    int newest;
    std::int64_t key;
  };
  std::vector<Entry> entries;
  for (const std::int64_t key : dirty_) {
    const Block* block = find(key);
    if (!block || !block->dirty) continue;
    const int listed = block->listed.empty() ? 0 : block->listed.back().patch->keyframe();
    const int used = block->used.empty() ? 0 : block->used.back()->keyframe();
    entries.push_back({std::max(listed, used), key});
  }
  dirty_.clear();
  std::sort(entries.begin(), entries.end(), [](const Entry& a, const Entry& b) {
    return a.newest != b.newest ? a.newest > b.newest : a.key < b.key;
  });
  std::vector<std::int64_t> keys;
  for (const Entry& e : entries) (keys.size() < most ? keys : dirty_).push_back(e.key);
  return keys;
}

void BlockMap::sample(std::int64_t key, std::vector<std::int64_t>& to_place) {
  Block* block = find(key);
  if (!block || !block->dirty) return;
  block->dirty = false;
  std::vector<PatchPtr> wanted = block->wanted();
  if (wanted == block->used) return;
  const std::vector<float> before = block->distances;
  update_distances(key, *block, std::move(wanted));
  to_place.push_back(key);
  const unsigned seen = neighbors_that_see(before, block->distances);
  for (int n = 1; n < kBlockNeighbors; ++n)
    if ((seen >> n) & 1) to_place.push_back(key - neighbor_step(n));
}

void BlockMap::update_distances(std::int64_t key, Block& block, std::vector<PatchPtr> wanted) {
  const std::vector<PatchPtr> gone = difference(block.used, wanted), come = difference(wanted, block.used);
  block.used = std::move(wanted);
  const BlockLattice at = lattice(key);
  // With more changes than this, computing the sums anew is cheaper.
  const bool in_steps = block.sums && gone.size() + come.size() < block.used.size();
  if (in_steps) {
    for (const PatchPtr& patch : gone) block.sums->take(at, patch->opened(), field_);
    for (const PatchPtr& patch : come) block.sums->add(at, patch->opened(), field_);
  }
  if (in_steps && block.sums->valid()) {
    block.sums->write_distances(field_, block.distances);
  } else {
    if (!block.sums) {
      block.sums = std::make_unique<BlockSums>();
      ++warm_;
    }
    sample_block(at, opened(block.used), field_, *block.sums, block.distances);
  }
  drop_if_unobserved(block.distances);
  keep_warm(key, block);
}

/// Frees sums that are not valid, and the least recently used ones if there are too many.
void BlockMap::keep_warm(std::int64_t key, Block& block) {
  if (!block.sums->valid()) {
    block.sums.reset();
    --warm_;
    return;
  }
  block.last_use = next_use_++;
  uses_.emplace_back(key, block.last_use);
  for (; warm_ > warm_blocks_ || uses_.size() > 4 * warm_blocks_ + 4; uses_.pop_front()) {
    Block* oldest = find(uses_.front().first);
    if (!oldest || !oldest->sums || oldest->last_use != uses_.front().second) continue;
    oldest->sums.reset();
    --warm_;
  }
}

BlockSurface BlockMap::vertices_of(std::int64_t key, const std::vector<PatchPtr>& used) const {
  std::array<const std::vector<float>*, kBlockNeighbors> upper{};
  for (int n = 0; n < kBlockNeighbors; ++n) {
    const Block* neighbor = find(key + neighbor_step(n));
    if (neighbor) upper[index(n)] = &neighbor->distances;
  }
  BlockSurface surface;
  // Returning here avoids decompressing the patches.
  if (upper[0] == nullptr || upper[0]->empty()) return surface;
  place_vertices(lattice(key), upper, opened(used), field_, surface);
  return surface;
}

void BlockMap::place(std::int64_t key, std::vector<std::int64_t>& to_mesh) {
  Block* block = find(key);
  if (!block) return;
  const BlockSurface surface = vertices_of(key, block->used);
  if (surface == block->surface) return;
  block->surface = BlockSurface(surface);  // the copy has no spare capacity
  for (int n = 0; n < kBlockNeighbors; ++n) to_mesh.push_back(key + neighbor_step(n));
}

std::optional<MeshBlock> BlockMap::mesh(std::int64_t key) {
  Block* block = find(key);
  if (!block) return std::nullopt;
  const auto lower = lower_surfaces(key);
  MeshBlock result = compact(key, join_vertices(lower), lower);
  const bool had_mesh = std::exchange(block->has_mesh, !result.mesh.triangles.empty());
  if (!had_mesh && !block->has_mesh) return std::nullopt;
  return result;
}

std::array<const BlockSurface*, kBlockNeighbors> BlockMap::lower_surfaces(std::int64_t key) const {
  std::array<const BlockSurface*, kBlockNeighbors> lower{};
  for (int n = 0; n < kBlockNeighbors; ++n)
    if (const Block* neighbor = find(key - neighbor_step(n))) lower[index(n)] = &neighbor->surface;
  return lower;
}

Mesh BlockMap::mesh_all(int threads, ProgressSink* progress, std::vector<int>& keyframe) {
  std::vector<std::int64_t> keys;
  for (auto& [key, block] : blocks_) {
    block.sums.reset();
    block.dirty = true;
    keys.push_back(key);
  }
  // Along the curve, blocks that are close in space follow each other, so that few patches have to be
  // decompressed at a time. Upper neighbors come later than a block itself, so that its distances can be
  // freed once its vertices are placed.
  std::ranges::sort(keys, {}, place_along_curve);
  ParallelProgress fusing(progress, "fusing", keys.size());
  for (std::size_t begin = 0; begin < keys.size(); begin += kBlocksAtOnce) {
    const auto some = std::span(keys).subspan(begin, std::min(kBlocksAtOnce, keys.size() - begin));
    std::vector<std::int64_t> unsampled;
    for (const std::int64_t key : some)
      for (int n = 0; n < kBlockNeighbors; ++n)
        if (Block* block = find(key + neighbor_step(n)); block && std::exchange(block->dirty, false))
          unsampled.push_back(key + neighbor_step(n));
    parallel_for(unsampled.size(), threads, [&](std::size_t i) {
      thread_local BlockSums sums;
      Block& block = *find(unsampled[i]);
      sample_block(lattice(unsampled[i]), opened(block.wanted()), field_, sums, block.distances);
      drop_if_unobserved(block.distances);
      fusing.step();  // The remaining steps take little time.
    });
    parallel_for(some.size(), threads, [&](std::size_t i) {
      Block& block = *find(some[i]);
      const BlockSurface surface = vertices_of(some[i], block.wanted());
      block.surface = BlockSurface(surface);
      std::vector<Listing>().swap(block.listed);
    });
    for (const std::int64_t key : some) std::vector<float>().swap(find(key)->distances);
  }
  std::sort(keys.begin(), keys.end());

  std::unordered_map<const BlockSurface*, int> first_vertex;
  std::size_t vertices = 0;
  for (const auto& [key, block] : blocks_) vertices += block.surface.positions.size();
  Mesh mesh;
  mesh.vertices_mm.reserve(vertices);
  mesh.normals.reserve(vertices);
  mesh.confidence.reserve(vertices);
  keyframe.reserve(vertices);
  for (const std::int64_t key : keys) {
    const BlockSurface& surface = find(key)->surface;
    first_vertex.emplace(&surface, static_cast<int>(mesh.vertices_mm.size()));
    mesh.vertices_mm.insert(mesh.vertices_mm.end(), surface.positions.begin(), surface.positions.end());
    mesh.normals.insert(mesh.normals.end(), surface.normals.begin(), surface.normals.end());
    keyframe.insert(keyframe.end(), surface.keyframes.begin(), surface.keyframes.end());
    mesh.confidence.insert(mesh.confidence.end(), surface.weights.begin(), surface.weights.end());
  }
  std::vector<std::vector<Eigen::Vector3i>> triangles(keys.size());
  parallel_for(keys.size(), threads, [&](std::size_t i) {
    if (find(keys[i])->surface.cells.empty()) return;
    const auto lower = lower_surfaces(keys[i]);
    const auto in_mesh = [&](const VertexName& name) {
      return first_vertex.at(lower[index(name.neighbor)]) + name.vertex;
    };
    for (const NamedTriangle& t : join_vertices(lower))
      triangles[i].emplace_back(in_mesh(t[0]), in_mesh(t[1]), in_mesh(t[2]));
  });
  blocks_.clear();
  std::size_t count = 0;
  for (const auto& of_block : triangles) count += of_block.size();
  mesh.triangles.reserve(count);
  for (const auto& of_block : triangles)
    mesh.triangles.insert(mesh.triangles.end(), of_block.begin(), of_block.end());
  fusing.end();
  return mesh;
}

void BlockMap::drop_if_empty(std::int64_t key) {
  const auto found = blocks_.find(key);
  if (found == blocks_.end() || !found->second.listed.empty() || !found->second.used.empty()) return;
  if (found->second.sums) --warm_;
  blocks_.erase(found);
}

}  // namespace gelslam::fusion::detail
