#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <vector>

#include "patch.hpp"

namespace gelslam::fusion::detail {

/// Voxels are stored in blocks of 8x8x8, only where there is surface. Voxel (i, j, k) is at voxel_size * (i,
/// j, k).
constexpr int kBlockEdge = 8;
constexpr int kBlockVoxels = kBlockEdge * kBlockEdge * kBlockEdge;

/// A neighbor's number has one bit per axis along which it is one block further (upper neighbors) or nearer
/// (lower neighbors): 1 for x, 2 for y, 4 for z.
constexpr int kBlockNeighbors = 8;

/// Encodes the coordinates of a block in one number. Keys are in lexicographic order of (z, y, x).
std::int64_t block_key(const Eigen::Vector3i& block_coordinate);
Eigen::Vector3i block_coordinate(std::int64_t key);
/// Returns what must be added to a block's key to get the key of its upper neighbor.
std::int64_t neighbor_step(int neighbor);
/// Returns the position of a block along a curve that visits all blocks and keeps neighbors close together
/// (Morton 1966).
std::uint64_t place_along_curve(std::int64_t key);

/// Distances up to which a patch influences blocks.
struct BlockReach {
  float voxel_size_mm;
  float surface_mm;  ///< A block is computed if a patch passes within this distance of it.
  float list_mm;     ///< Such a block then uses every patch that passes within this distance.
};
/// Two sheets merge if they are less than 0.85 truncations apart, so the merged surface is never further than
/// half of that from one of them.
inline BlockReach block_reach(float voxel_size_mm, float truncation_mm) {
  return {voxel_size_mm, 0.45f * truncation_mm, truncation_mm};
}

/// A block through which a patch passes.
struct PassedBlock {
  std::int64_t key;
  bool near;  ///< Within surface_mm, and not only within list_mm.
};
/// Returns the blocks in ascending order of keys. Throws Error when the patch is too far from the map's
/// origin.
std::vector<PassedBlock> blocks_of(const Patch& patch, const BlockReach& reach);

}  // namespace gelslam::fusion::detail
