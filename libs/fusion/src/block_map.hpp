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

/// The blocks of a mesh: which patches each should ask and which it holds. A change goes through three
/// passes, each over the blocks that the one before has named: sample, place, mesh. mesh_all() runs them over
/// all blocks at once.
class BlockMap {
 public:
  BlockMap(const Field& field, float voxel_size_mm, int warm_blocks)
      : field_(field), voxel_(voxel_size_mm), warm_blocks_(static_cast<std::size_t>(warm_blocks)) {}

  void list(const PlacedPatch& placed);
  void unlist(const PlacedPatch& placed);

  /// Returns at most so many blocks whose patches have changed since they were sampled, those of the newest
  /// patches first.
  std::vector<std::int64_t> take_dirty(std::size_t most);

  /// Brings a block's distances up to date; adds the blocks whose vertices depend on them.
  void sample(std::int64_t key, std::vector<std::int64_t>& to_place);
  /// Brings a block's vertices up to date; adds the blocks whose triangles depend on them.
  void place(std::int64_t key, std::vector<std::int64_t>& to_mesh);
  /// Returns a block's mesh, or nothing when it is empty and was so.
  std::optional<MeshBlock> mesh(std::int64_t key);

  /// Makes all passes over every block, on `threads` threads (0: all cores); the result is one mesh whose
  /// vertices the blocks share. The same for any number of threads. Tells `progress` of the task "fusing".
  /// Fills in `keyframe`, the one that sees a vertex best.
  Mesh mesh_all(int threads, ProgressSink* progress, std::vector<int>& keyframe);

  /// Forgets a block in which no patch is left.
  void drop_if_empty(std::int64_t key);

 private:
  struct Listing {
    PatchPtr patch;
    bool near;
  };
  struct Block {
    std::vector<Listing> listed;      ///< by keyframe
    std::vector<PatchPtr> used;       ///< by keyframe: what distances and vertices are made of
    std::unique_ptr<BlockSums> sums;  ///< of `used`; null while cold
    std::uint64_t last_use = 0;       ///< of the sums
    std::vector<float> distances;     ///< empty when nothing was observed
    BlockSurface surface;
    bool dirty = false, has_mesh = false;

    /// Returns the patches that the block should hold: all listed ones where one of them is near.
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
  std::deque<std::pair<std::int64_t, std::uint64_t>> uses_;  ///< of sums: block, number; oldest first
  std::uint64_t next_use_ = 0;
  std::size_t warm_ = 0;  ///< blocks with sums
};

}  // namespace gelslam::fusion::detail
