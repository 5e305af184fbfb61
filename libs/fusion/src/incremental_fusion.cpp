// Fuses patches to a mesh, all at once or step by step. PatchPlaces knows which patches should be where,
// BlockMap computes the blocks that they pass. fuse() declares all patches and finishes; a live scan calls
// work() repeatedly. Both give the same mesh.

#include "gelslam/fusion/incremental_fusion.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <map>

#include "block_map.hpp"
#include "field.hpp"
#include "gelslam/core/error.hpp"
#include "gelslam/core/index.hpp"
#include "gelslam/core/parallel.hpp"
#include "gelslam/core/process.hpp"
#include "gelslam/mesh/mesh.hpp"
#include "patch_places.hpp"

namespace gelslam {
namespace {

using namespace fusion::detail;

/// Number of moved patches that are placed before their blocks are updated. Each block is then updated once
/// for all of them, while only a few patches have some blocks at the old and some at the new pose.
constexpr int kMovesAtOnce = 48;
/// Number of blocks of moved patches per call of work(). A new patch waits for at most one such round, some
/// tens of milliseconds.
constexpr std::size_t kBlocksPerRound = 256;

void check(const FusionOptions& o) {
  if (!(o.voxel_size_mm >= 0.01 && o.voxel_size_mm <= 10))
    throw Error("the voxel size has to be 0.01 to 10 mm");
  if (!(o.truncation_mm >= 2 * o.voxel_size_mm && o.truncation_mm <= 100))
    throw Error("the truncation has to be at least two voxels and at most 100 mm");
  if (!(o.min_weight > 0) || !std::isfinite(o.min_weight))
    throw Error("the minimal weight has to be positive");
}

/// Removes islands and vertices that no triangle uses. Islands are shells (parts connected by shared
/// vertices) smaller than `min_area_mm2`, and shells that only a single keyframe shows, unless that is also
/// true of the largest shell. `keyframe` holds the keyframe of each vertex. The order of vertices and
/// triangles is kept.
Mesh without_islands(const Mesh& mesh, const std::vector<int>& keyframe, double min_area_mm2,
                     std::int64_t* islands) {
  const MeshShells shells = find_shells(mesh);
  std::vector<int> seen_by(shells.area_mm2.size(), -1);
  std::vector<bool> is_kept(shells.area_mm2.size(), false);
  for (std::size_t i = 0; i < mesh.triangles.size(); ++i) {
    const std::size_t shell = index(shells.of_triangle[i]);
    const int by = keyframe[index(mesh.triangles[i][0])];
    if (seen_by[shell] < 0) seen_by[shell] = by;
    if (seen_by[shell] != by) is_kept[shell] = true;
  }
  const bool all_alike = shells.largest < 0 || !is_kept[index(shells.largest)];
  for (std::size_t shell = 0; shell < is_kept.size(); ++shell)
    is_kept[shell] =
        shells.area_mm2[shell] >= min_area_mm2 && (min_area_mm2 == 0 || all_alike || is_kept[shell]);
  if (islands != nullptr) *islands = std::count(is_kept.begin(), is_kept.end(), false);
  std::vector<Eigen::Vector3i> kept;
  kept.reserve(mesh.triangles.size());
  for (std::size_t i = 0; i < mesh.triangles.size(); ++i)
    if (is_kept[index(shells.of_triangle[i])]) kept.push_back(mesh.triangles[i]);
  return submesh(mesh, kept);
}

}  // namespace

class IncrementalFusion::Impl {
 public:
  Impl(const FusionOptions& fusion, const IncrementalOptions& options)
      : field_(static_cast<float>(fusion.truncation_mm), static_cast<float>(fusion.min_weight)),
        places_(
            block_reach(static_cast<float>(fusion.voxel_size_mm), static_cast<float>(fusion.truncation_mm)),
            options),
        blocks_(field_, static_cast<float>(fusion.voxel_size_mm), options.warm_blocks) {}

  void set_patches(const std::vector<PosedSurface>& patches, double gradient_scale) {
    places_.declare(patches, gradient_scale);
  }

  bool work() {
    std::vector<std::int64_t> keys;
    if (const auto id = places_.newest_new()) {
      keys = place_patch(*id);
    } else {
      keys = blocks_.take_dirty(kBlocksPerRound);
      if (keys.empty()) {
        for (int moves = 0; moves < kMovesAtOnce && places_.newest_changed(); ++moves)
          place_patch(*places_.newest_changed());
        keys = blocks_.take_dirty(kBlocksPerRound);
      }
      if (keys.empty()) return false;
    }
    update(keys);
    return true;
  }

  Mesh finish(int threads, ProgressSink* progress, std::vector<int>& keyframe) {
    place_all(threads);
    places_.forget();  // Now the memory of a patch is freed as soon as all its blocks are done.
    return blocks_.mesh_all(threads, progress, keyframe);
  }

  std::vector<MeshBlock> take_changed_blocks() {
    std::vector<MeshBlock> result;
    result.reserve(ready_.size());
    for (auto& [key, block] : ready_) result.push_back(std::move(block));
    ready_.clear();
    return result;
  }

 private:
  /// Computes the given blocks again, and everything that depends on them.
  void update(const std::vector<std::int64_t>& keys) {
    std::vector<std::int64_t> to_place, to_mesh;
    const auto sort_out = [](std::vector<std::int64_t>& named) {
      std::sort(named.begin(), named.end());
      named.erase(std::unique(named.begin(), named.end()), named.end());
    };
    for (const std::int64_t key : keys) blocks_.sample(key, to_place);
    sort_out(to_place);
    for (const std::int64_t key : to_place) blocks_.place(key, to_mesh);
    sort_out(to_mesh);
    for (const std::int64_t key : to_mesh)
      if (auto block = blocks_.mesh(key)) ready_.insert_or_assign(key, std::move(*block));
    for (const std::int64_t key : keys) blocks_.drop_if_empty(key);
  }

  /// Places a patch at its wanted pose. Returns the blocks through which it passes there.
  std::vector<std::int64_t> place_patch(int id) {
    const PlacedPatch before = places_.take_out(id);
    if (before.patch) blocks_.unlist(before);
    places_.put_in(id, {});  // This remains if the following code throws.
    const PlacedPatch now = places_.make(id, before);
    places_.put_in(id, now);
    if (!now.patch) return {};
    blocks_.list(now);
    std::vector<std::int64_t> keys;
    for (const PassedBlock& passed : now.blocks) keys.push_back(passed.key);
    return keys;
  }

  /// Places all patches that have changed.
  void place_all(int threads) {
    const std::vector<int> ids = places_.all_changed();
    std::vector<PlacedPatch> before(ids.size()), now(ids.size());
    for (std::size_t i = 0; i < ids.size(); ++i) {
      before[i] = places_.take_out(ids[i]);
      if (before[i].patch) blocks_.unlist(before[i]);
    }
    parallel_for(ids.size(), threads, [&](std::size_t i) { now[i] = places_.make(ids[i], before[i]); });
    for (std::size_t i = 0; i < ids.size(); ++i) {
      if (now[i].patch) blocks_.list(now[i]);
      places_.put_in(ids[i], std::move(now[i]));
    }
  }

  Field field_;
  PatchPlaces places_;
  BlockMap blocks_;
  std::map<std::int64_t, MeshBlock> ready_;
};

IncrementalFusion::IncrementalFusion(const FusionOptions& fusion, const IncrementalOptions& options) {
  check(fusion);
  impl_ = std::make_unique<Impl>(fusion, options);
}
IncrementalFusion::~IncrementalFusion() = default;

void IncrementalFusion::set_patches(const std::vector<PosedSurface>& patches, double gradient_scale) {
  impl_->set_patches(patches, gradient_scale);
}
bool IncrementalFusion::work() { return impl_->work(); }
std::vector<MeshBlock> IncrementalFusion::take_changed_blocks() { return impl_->take_changed_blocks(); }

Mesh IncrementalFusion::finish(int threads, double min_shell_mm2, ProgressSink* progress,
                               std::int64_t* islands) {
  std::vector<int> keyframe;
  const Mesh mesh = impl_->finish(threads, progress, keyframe);
  impl_.reset();  // The next step needs the memory.
  return_free_memory();
  return without_islands(mesh, keyframe, min_shell_mm2, islands);
}

Mesh fuse(const std::vector<PosedSurface>& patches, const FusionOptions& options, double gradient_scale,
          ProgressSink* progress, std::int64_t* islands) {
  // Numbered by their order, because the caller's ids may contain duplicates.
  std::vector<PosedSurface> numbered = patches;
  for (std::size_t i = 0; i < numbered.size(); ++i) {
    check_patch(numbered[i]);
    numbered[i].id = static_cast<int>(i);
  }
  IncrementalFusion fusion(options, {});
  fusion.set_patches(numbered, gradient_scale);
  return fusion.finish(options.threads, options.min_shell_mm2, progress, islands);
}

}  // namespace gelslam
