#include "live_blocks.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <iterator>

namespace gelslam::fusion::detail {
namespace {

bool is_before(const PatchPtr& a, const PatchPtr& b) {
  return a->keyframe() != b->keyframe() ? a->keyframe() < b->keyframe() : a < b;
}

PatchList plain(const std::vector<PatchPtr>& patches) {
  PatchList list;
  for (const PatchPtr& p : patches) list.push_back(p.get());
  return list;
}

std::vector<PatchPtr> difference(const std::vector<PatchPtr>& a, const std::vector<PatchPtr>& b) {
  std::vector<PatchPtr> result;
  std::set_difference(a.begin(), a.end(), b.begin(), b.end(), std::back_inserter(result), is_before);
  return result;
}

bool differs(float a, float b) { return !(a == b || (std::isnan(a) && std::isnan(b))); }

/// Bit n is set when lower neighbor n sees a change: its cells reach into the voxels of the lowest layers.
unsigned neighbors_that_see(const std::vector<float>& before, const std::vector<float>& after) {
  unsigned seen = 0;
  const auto at = [](const std::vector<float>& d, std::size_t i) { return d.empty() ? std::nanf("") : d[i]; };
  for (int i = 0; i < block_voxels; ++i) {
    const int lowest = (i % block_edge == 0 ? 1 : 0) | (i / block_edge % block_edge == 0 ? 2 : 0) |
                       (i < block_edge * block_edge ? 4 : 0);
    const std::size_t voxel = static_cast<std::size_t>(i);
    if (lowest == 0 || !differs(at(before, voxel), at(after, voxel))) continue;
    for (int n = 1; n < block_neighbors; ++n) {
      if ((n & lowest) == n) seen |= 1u << n;
    }
  }
  return seen;
}

/// The vertices that the triangles use, and only those.
MeshBlock compact(std::int64_t key, const std::vector<NamedTriangle>& triangles,
                  const std::array<const BlockSurface*, block_neighbors>& lower) {
  MeshBlock block{key, {}, {}};
  std::array<std::vector<int>, block_neighbors> new_index;
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
  return block;
}

}  // namespace

void LiveBlocks::mark_dirty(std::int64_t key, Block& block) {
  if (!block.dirty) dirty_.push_back(key);
  block.dirty = true;
}

void LiveBlocks::list(const PlacedPatch& placed) {
  for (const PassedBlock& passed : placed.blocks) {
    Block& block = blocks_[passed.key];
    const auto after = std::upper_bound(
        block.listed.begin(), block.listed.end(), placed.patch,
        [](const PatchPtr& patch, const Listing& listing) { return is_before(patch, listing.patch); });
    block.listed.insert(after, {placed.patch, passed.near});
    mark_dirty(passed.key, block);
  }
}

void LiveBlocks::unlist(const PlacedPatch& placed) {
  for (const PassedBlock& passed : placed.blocks) {
    Block& block = blocks_.at(passed.key);
    std::erase_if(block.listed, [&](const Listing& listing) { return listing.patch == placed.patch; });
    mark_dirty(passed.key, block);
  }
}

std::vector<std::int64_t> LiveBlocks::take_dirty() {
  struct Entry {
    int newest;
    std::int64_t key;
  };
  std::vector<Entry> entries;
  for (const std::int64_t key : dirty_) {
    const Block* block = find(key);
    if (!block || !block->dirty) continue;
    const int listed = block->listed.empty() ? 0 : block->listed.back().patch->keyframe();
    const int held = block->held.empty() ? 0 : block->held.back()->keyframe();
    entries.push_back({std::max(listed, held), key});
  }
  dirty_.clear();
  std::sort(entries.begin(), entries.end(), [](const Entry& a, const Entry& b) {
    return a.newest != b.newest ? a.newest > b.newest : a.key < b.key;
  });
  std::vector<std::int64_t> keys;
  for (const Entry& e : entries) keys.push_back(e.key);
  return keys;
}

void LiveBlocks::sample(std::int64_t key, std::vector<std::int64_t>& to_place) {
  Block* block = find(key);
  if (!block || !block->dirty) return;
  block->dirty = false;
  std::vector<PatchPtr> wanted;
  if (std::any_of(block->listed.begin(), block->listed.end(), [](const Listing& l) { return l.near; })) {
    for (const Listing& listing : block->listed) wanted.push_back(listing.patch);
  }
  if (wanted == block->held) return;
  const std::vector<float> before = block->distances;
  update_distances(key, *block, std::move(wanted));
  to_place.push_back(key);
  const unsigned seen = neighbors_that_see(before, block->distances);
  for (int n = 1; n < block_neighbors; ++n) {
    if ((seen >> n) & 1) to_place.push_back(key - neighbor_step(n));
  }
}

void LiveBlocks::update_distances(std::int64_t key, Block& block, std::vector<PatchPtr> wanted) {
  const std::vector<PatchPtr> gone = difference(block.held, wanted), come = difference(wanted, block.held);
  block.held = std::move(wanted);
  const BlockLattice at = lattice(key);
  // Beyond that, starting again is no more work.
  const bool in_steps = block.sums && gone.size() + come.size() < block.held.size();
  if (in_steps) {
    for (const PatchPtr& patch : gone) block.sums->take(at, *patch, field_);
    for (const PatchPtr& patch : come) block.sums->add(at, *patch, field_);
  }
  if (in_steps && block.sums->valid()) {
    block.sums->write_distances(field_, block.distances);
  } else {
    if (!block.sums) {
      block.sums = std::make_unique<BlockSums>();
      ++warm_;
    }
    sample_block(at, plain(block.held), field_, *block.sums, block.distances);
  }
  if (std::all_of(block.distances.begin(), block.distances.end(), [](float d) { return std::isnan(d); })) {
    std::vector<float>().swap(block.distances);
  }
  keep_warm(key, block);
}

/// Drops sums that are of no use, and those not used for longest while there are too many.
void LiveBlocks::keep_warm(std::int64_t key, Block& block) {
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

void LiveBlocks::place(std::int64_t key, std::vector<std::int64_t>& to_mesh) {
  Block* block = find(key);
  if (!block) return;
  std::array<const std::vector<float>*, block_neighbors> upper{};
  for (int n = 0; n < block_neighbors; ++n) {
    const Block* neighbor = find(key + neighbor_step(n));
    if (neighbor) upper[static_cast<std::size_t>(n)] = &neighbor->distances;
  }
  BlockSurface surface;
  place_vertices(lattice(key), upper, plain(block->held), field_, surface);
  if (surface == block->surface) return;
  block->surface = BlockSurface(surface);  // a copy has no spare room
  for (int n = 0; n < block_neighbors; ++n) to_mesh.push_back(key + neighbor_step(n));
}

std::optional<MeshBlock> LiveBlocks::mesh(std::int64_t key) {
  Block* block = find(key);
  if (!block) return std::nullopt;
  std::array<const BlockSurface*, block_neighbors> lower{};
  for (int n = 0; n < block_neighbors; ++n) {
    const Block* neighbor = find(key - neighbor_step(n));
    if (neighbor) lower[static_cast<std::size_t>(n)] = &neighbor->surface;
  }
  MeshBlock result = compact(key, join_vertices(lower), lower);
  const bool had_mesh = std::exchange(block->has_mesh, !result.mesh.triangles.empty());
  if (!had_mesh && !block->has_mesh) return std::nullopt;
  return result;
}

void LiveBlocks::drop_if_empty(std::int64_t key) {
  const auto found = blocks_.find(key);
  if (found == blocks_.end() || !found->second.listed.empty() || !found->second.held.empty()) return;
  if (found->second.sums) --warm_;
  blocks_.erase(found);
}

}  // namespace gelslam::fusion::detail
