#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <deque>
#include <memory>
#include <optional>
#include <unordered_map>
#include <utility>
#include <vector>

#include "block_mesher.hpp"
#include "block_sums.hpp"
#include "gelslam/core/progress.hpp"
#include "gelslam/mesh/mesh.hpp"
#include "patch_places.hpp"

namespace gelslam::fusion::detail {

/// The voxel blocks of a mesh, with the patches that each block depends on. A change is processed in three
/// passes: sample (distances), place (vertices), mesh (triangles). Each pass returns the blocks that the next
/// one has to process. mesh_all() runs the passes over all blocks.
class BlockMap {
 public:
  BlockMap(const Field& field, float voxel_size_mm, int warm_blocks)
      : field_(field), voxel_(voxel_size_mm), warm_blocks_(static_cast<std::size_t>(warm_blocks)) {}

  void list(const PlacedPatch& placed);
  void unlist(const PlacedPatch& placed);

  /// Returns at most `most` blocks whose patches have changed since they were sampled, those of the newest
  /// patches first.
  std::vector<std::int64_t> take_dirty(std::size_t most);

  /// Updates the distances of a block, and appends the blocks whose vertices depend on them to `to_place`.
  void sample(std::int64_t key, std::vector<std::int64_t>& to_place);
  /// Updates the vertices of a block, and appends the blocks whose triangles depend on them to `to_mesh`.
  void place(std::int64_t key, std::vector<std::int64_t>& to_mesh);
  /// Returns a block's mesh, or nothing if it is empty and was empty before.
  std::optional<MeshBlock> mesh(std::int64_t key);

  /// Runs all passes over every block on `threads` threads (0: all cores) and returns one mesh with shared
  /// vertices. The result does not depend on the number of threads. `progress` receives the task "fusing".
  /// `keyframe` receives, for each vertex, the keyframe with the largest weight there. The map is empty
  /// afterwards.
  Mesh mesh_all(int threads, ProgressSink* progress, std::vector<int>& keyframe);

  /// Removes a block in which no patch is left.
  void drop_if_empty(std::int64_t key);

 private:
  struct Listing {
    PatchPtr patch;
    bool near;
  };
  struct Block {
    std::vector<Listing> listed;  ///< Patches that reach the block, ordered by keyframe.
    /// Patches from which distances and vertices were computed, ordered by keyframe.
    std::vector<PatchPtr> used;
    std::unique_ptr<BlockSums> sums;  ///< Sums over `used`; null if they are not kept in memory.
    std::uint64_t last_use = 0;       ///< of the sums
    std::vector<float> distances;     ///< empty when nothing was observed
    BlockSurface surface;
    bool dirty = false, has_mesh = false;

    /// Returns the patches from which the block should be computed: all listed ones if the surface of at
    /// least one of them is near the block, else none.
    std::vector<PatchPtr> wanted() const {
      std::vector<PatchPtr> patches;
      if (std::any_of(listed.begin(), listed.end(), [](const Listing& l) { return l.near; }))
        for (const Listing& listing : listed) patches.push_back(listing.patch);
      return patches;
    }
  };

  Block* find(std::int64_t key) {
    const auto found = blocks_.find(key);
    return found == blocks_.end() ? nullptr : &found->second;
  }
  const Block* find(std::int64_t key) const { return const_cast<BlockMap*>(this)->find(key); }
  BlockLattice lattice(std::int64_t key) const { return {block_coordinate(key) * kBlockEdge, voxel_}; }
  void mark_dirty(std::int64_t key, Block& block);
  std::array<const BlockSurface*, kBlockNeighbors> lower_surfaces(std::int64_t key) const;
  BlockSurface vertices_of(std::int64_t key, const std::vector<PatchPtr>& used) const;
  void update_distances(std::int64_t key, Block& block, std::vector<PatchPtr> wanted);
  void keep_warm(std::int64_t key, Block& block);

  const Field& field_;
  float voxel_;
  std::size_t warm_blocks_;
  std::unordered_map<std::int64_t, Block> blocks_;
  std::vector<std::int64_t> dirty_;
  /// Uses of sums as (block key, number of the use), oldest first.
  std::deque<std::pair<std::int64_t, std::uint64_t>> uses_;
  std::uint64_t next_use_ = 0;
  std::size_t warm_ = 0;  ///< Number of blocks that have sums.
};

}  // namespace gelslam::fusion::detail
