#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <unordered_map>
#include <vector>

#include "patch.hpp"

namespace gelslam::fusion::detail {

/// Voxels come in blocks of 8x8x8, only where there is surface. Voxel (i,j,k) lies at voxel_size * (i,j,k).
constexpr int block_edge = 8;
constexpr int block_voxels = block_edge * block_edge * block_edge;

struct Block {
  Eigen::Vector3i first_voxel;  ///< index of the block's lowest corner
  std::vector<int> patches;     ///< which patches reach into it, ascending
};

/// The blocks in which the fused surface can lie, in lexicographic order, and how to find them.
class BlockGrid {
 public:
  /// A block is kept when a patch passes within `surface_reach_mm` of it, and then lists every patch that
  /// passes within `list_reach_mm`.
  BlockGrid(const std::vector<Patch>& patches, float voxel_size_mm, float surface_reach_mm,
            float list_reach_mm, int threads);

  const std::vector<Block>& blocks() const { return blocks_; }
  /// Index of the block at this block coordinate, or -1.
  int find(const Eigen::Vector3i& block_coordinate) const;

 private:
  std::vector<Block> blocks_;
  std::unordered_map<std::int64_t, int> index_;
};

}  // namespace gelslam::fusion::detail
