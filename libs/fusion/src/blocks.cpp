#include "blocks.hpp"

#include <algorithm>
#include <cmath>

#include "gelslam/core/error.hpp"
#include "parallel.hpp"

namespace gelslam::fusion::detail {
namespace {

constexpr int coordinate_bits = 20;
constexpr std::int64_t coordinate_offset = std::int64_t{1} << (coordinate_bits - 1);

/// Order of keys is lexicographic order of (z, y, x).
std::int64_t key_of(const Eigen::Vector3i& b) {
  std::int64_t key = 0;
  for (int axis = 2; axis >= 0; --axis) key = (key << coordinate_bits) | (b[axis] + coordinate_offset);
  return key;
}

Eigen::Vector3i coordinate_of(std::int64_t key) {
  Eigen::Vector3i b;
  for (int axis = 0; axis < 3; ++axis) {
    b[axis] = static_cast<int>((key & ((std::int64_t{1} << coordinate_bits) - 1)) - coordinate_offset);
    key >>= coordinate_bits;
  }
  return b;
}

struct Entry {
  std::int64_t key;
  int patch;
  bool near;  ///< within surface reach, not only list reach
};

/// The blocks one patch passes through: its points, moved along their normals by up to `list_reach`, and
/// dilated so that the spacing of the samples leaves no gap.
std::vector<Entry> blocks_of(const Patch& patch, int id, float voxel, float surface_reach, float list_reach) {
  constexpr int stride = 2;
  const float block_mm = voxel * static_cast<float>(block_edge);
  const float margin = 2.0f * voxel;
  const int steps = std::max(1, static_cast<int>(std::ceil(list_reach / (2.0f * margin))));
  const float spacing = list_reach / static_cast<float>(steps);
  std::vector<Entry> entries;
  patch.for_each_point(stride, [&](const Eigen::Vector3f& point, const Eigen::Vector3f& normal, float) {
    for (int step = -steps; step <= steps; ++step) {
      const float along = spacing * static_cast<float>(step);
      const Eigen::Vector3f p = point + along * normal;
      const Eigen::Array3f low = ((p.array() - margin) / block_mm).floor();
      const Eigen::Array3f high = ((p.array() + margin) / block_mm).floor();
      if (low.minCoeff() < -coordinate_offset || high.maxCoeff() >= coordinate_offset) {
        throw Error("cannot fuse: a keyframe lies too far from the map's origin for this voxel size");
      }
      const bool near = std::fabs(along) <= surface_reach + 0.5f * spacing;
      for (int z = static_cast<int>(low.z()); z <= static_cast<int>(high.z()); ++z) {
        for (int y = static_cast<int>(low.y()); y <= static_cast<int>(high.y()); ++y) {
          for (int x = static_cast<int>(low.x()); x <= static_cast<int>(high.x()); ++x) {
            const std::int64_t key = key_of({x, y, z});
            // Neighbouring samples mostly fall into the same block: most repetitions end here.
            if (!entries.empty() && entries.back().key == key && entries.back().near == near) continue;
            entries.push_back({key, id, near});
          }
        }
      }
    }
  });
  std::sort(entries.begin(), entries.end(), [](const Entry& a, const Entry& b) {
    return a.key != b.key ? a.key < b.key : a.near > b.near;  // near first, so that unique keeps it
  });
  entries.erase(std::unique(entries.begin(), entries.end(),
                            [](const Entry& a, const Entry& b) { return a.key == b.key; }),
                entries.end());
  return entries;
}

}  // namespace

BlockGrid::BlockGrid(const std::vector<Patch>& patches, float voxel_size_mm, float surface_reach_mm,
                     float list_reach_mm, int threads) {
  std::vector<std::vector<Entry>> of_patch(patches.size());
  parallel_for(patches.size(), threads, [&](std::size_t i) {
    of_patch[i] = blocks_of(patches[i], static_cast<int>(i), voxel_size_mm, surface_reach_mm, list_reach_mm);
  });
  std::vector<Entry> all;
  for (const auto& entries : of_patch) all.insert(all.end(), entries.begin(), entries.end());
  std::sort(all.begin(), all.end(), [](const Entry& a, const Entry& b) {
    return a.key != b.key ? a.key < b.key : a.patch < b.patch;
  });
  for (std::size_t begin = 0, end = 0; begin < all.size(); begin = end) {
    bool near = false;
    for (end = begin; end < all.size() && all[end].key == all[begin].key; ++end) near = near || all[end].near;
    if (!near) continue;
    Block block{coordinate_of(all[begin].key) * block_edge, {}};
    for (std::size_t i = begin; i < end; ++i) block.patches.push_back(all[i].patch);
    index_.emplace(all[begin].key, static_cast<int>(blocks_.size()));
    blocks_.push_back(std::move(block));
  }
}

int BlockGrid::find(const Eigen::Vector3i& block_coordinate) const {
  const auto found = index_.find(key_of(block_coordinate));
  return found == index_.end() ? -1 : found->second;
}

}  // namespace gelslam::fusion::detail
