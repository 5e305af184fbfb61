#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <vector>

#include "patch.hpp"

namespace gelslam::fusion::detail {

/// Voxels come in blocks of 8x8x8, only where there is surface. Voxel (i,j,k) lies at voxel_size * (i,j,k).
constexpr int kBlockEdge = 8;
constexpr int kBlockVoxels = kBlockEdge * kBlockEdge * kBlockEdge;

/// Neighbors are numbered by the axes in which they are one block further (or nearer): 1 x, 2 y, 4 z.
constexpr int kBlockNeighbors = 8;

/// A block's place in one number; order of keys is lexicographic order of (z, y, x).
std::int64_t block_key(const Eigen::Vector3i& block_coordinate);
Eigen::Vector3i block_coordinate(std::int64_t key);
/// What to add to a block's key to get that of its upper neighbor.
std::int64_t neighbor_step(int neighbor);
/// Its place along a curve that passes all blocks and stays near what it has passed (Morton 1966).
std::uint64_t place_along_curve(std::int64_t key);

/// How far a patch reaches.
struct BlockReach {
  float voxel_size_mm;
  float surface_mm;  ///< a block is wanted when a patch passes within this of it,
  float list_mm;     ///< and then asks every patch that passes within this
};
/// Two sheets merge while they are less than 0.85 truncations apart, so the surface is never further than
/// half of that from one of them.
inline BlockReach block_reach(float voxel_size_mm, float truncation_mm) {
  return {voxel_size_mm, 0.45f * truncation_mm, truncation_mm};
}

/// A block that a patch passes through.
struct PassedBlock {
  std::int64_t key;
  bool near;  ///< within surface reach, not only list reach
};
/// Ascending by key. Throws Error when the patch lies too far from the map's origin.
std::vector<PassedBlock> blocks_of(const Patch& patch, const BlockReach& reach);

}  // namespace gelslam::fusion::detail
