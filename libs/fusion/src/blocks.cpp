// Keys of voxel blocks, and the blocks through which a patch passes.

#include "blocks.hpp"

#include <algorithm>
#include <cmath>

#include "gelslam/core/error.hpp"

namespace gelslam::fusion::detail {
namespace {

constexpr int kCoordinateBits = 20;
constexpr std::int64_t kCoordinateOffset = std::int64_t{1} << (kCoordinateBits - 1);

/// Collects the blocks through which a patch passes. A small cache removes most duplicates, because
/// neighboring samples fall into the same few blocks.
class PassedBlocks {
 public:
  PassedBlocks() : recent_(kSlots, {-1, false}) {}

  void add(std::int64_t key, bool near) {
    constexpr std::uint64_t multiplier =
        0x9E3779B97F4A7C15u;  // The golden ratio spreads bits upward (Fibonacci hashing).
    PassedBlock& slot = recent_[(static_cast<std::uint64_t>(key) * multiplier) >> (64 - kSlotBits)];
    if (slot.key == key && (slot.near || !near)) return;
    slot = {key, near};
    all_.push_back(slot);
  }

  std::vector<PassedBlock> sorted() && {
    std::sort(all_.begin(), all_.end(), [](const PassedBlock& a, const PassedBlock& b) {
      // Near ones first, so that unique() keeps them.
      return a.key != b.key ? a.key < b.key : a.near > b.near;
    });
    const auto same = [](const PassedBlock& a, const PassedBlock& b) { return a.key == b.key; };
    all_.erase(std::unique(all_.begin(), all_.end(), same), all_.end());
    all_.shrink_to_fit();
    return std::move(all_);
  }

 private:
  static constexpr int kSlotBits = 12;
  static constexpr std::size_t kSlots = std::size_t{1} << kSlotBits;

  std::vector<PassedBlock> recent_, all_;
};

}  // namespace

std::int64_t block_key(const Eigen::Vector3i& b) {
  std::int64_t key = 0;
  for (int axis = 2; axis >= 0; --axis) key = (key << kCoordinateBits) | (b[axis] + kCoordinateOffset);
  return key;
}

Eigen::Vector3i block_coordinate(std::int64_t key) {
  Eigen::Vector3i b;
  for (int axis = 0; axis < 3; ++axis) {
    b[axis] = static_cast<int>((key & ((std::int64_t{1} << kCoordinateBits) - 1)) - kCoordinateOffset);
    key >>= kCoordinateBits;
  }
  return b;
}

std::int64_t neighbor_step(int neighbor) {
  std::int64_t step = 0;
  for (int axis = 2; axis >= 0; --axis) step = (step << kCoordinateBits) + ((neighbor >> axis) & 1);
  return step;
}

std::uint64_t place_along_curve(std::int64_t key) {
  std::uint64_t place = 0;
  for (int bit = kCoordinateBits - 1; bit >= 0; --bit)
    for (int axis = 2; axis >= 0; --axis)
      place = place << 1 | (static_cast<std::uint64_t>(key) >> (axis * kCoordinateBits + bit) & 1);
  return place;
}

/// The patch's points are moved along their normals by up to the reach. A margin around each sample makes
/// sure that the spacing of the samples leaves no block out.
std::vector<PassedBlock> blocks_of(const Patch& patch, const BlockReach& reach) {
  constexpr int stride = 2;
  const float block_mm = reach.voxel_size_mm * static_cast<float>(kBlockEdge);
  const float margin = 2.0f * reach.voxel_size_mm;
  const int steps = std::max(1, static_cast<int>(std::ceil(reach.list_mm / (2.0f * margin))));
  const float spacing = reach.list_mm / static_cast<float>(steps);
  // One block at either end of the range is left free, so that every block has neighbors.
  const float lowest = static_cast<float>(1 - kCoordinateOffset), highest = -lowest - 1;
  PassedBlocks passed;
  patch.for_each_point(stride, [&](const Eigen::Vector3f& point, const Eigen::Vector3f& normal) {
    for (int step = -steps; step <= steps; ++step) {
      const float along = spacing * static_cast<float>(step);
      const Eigen::Vector3f p = point + along * normal;
      const Eigen::Array3f low = ((p.array() - margin) / block_mm).floor();
      const Eigen::Array3f high = ((p.array() + margin) / block_mm).floor();
      if (low.minCoeff() < lowest || high.maxCoeff() > highest)
        throw Error("cannot fuse: a keyframe lies too far from the map's origin for this voxel size");
      const bool near = std::fabs(along) <= reach.surface_mm + 0.5f * spacing;
      for (int z = static_cast<int>(low.z()); z <= static_cast<int>(high.z()); ++z) {
        for (int y = static_cast<int>(low.y()); y <= static_cast<int>(high.y()); ++y)
          for (int x = static_cast<int>(low.x()); x <= static_cast<int>(high.x()); ++x)
            passed.add(block_key({x, y, z}), near);
      }
    }
  });
  return std::move(passed).sorted();
}

}  // namespace gelslam::fusion::detail
