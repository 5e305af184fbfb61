#include "gelslam/fusion/incremental_fusion.hpp"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <map>

#include "field.hpp"
#include "fusion_options.hpp"
#include "gelslam/core/error.hpp"
#include "live_blocks.hpp"
#include "patch_places.hpp"

namespace gelslam {
namespace {

using namespace fusion::detail;

/// Moved patches that are carried over before their blocks are made again: each block is then made again once
/// for all of them, and the newest appear soon all the same.
constexpr int moves_at_once = 48;
/// Blocks of moved patches in a round: a new patch waits for no more than one round, a few times ten
/// milliseconds.
constexpr std::size_t blocks_per_round = 256;

void check(const IncrementalOptions& o) {
  if (!(o.budget_ms >= 0) || !std::isfinite(o.budget_ms))
    throw Error("the time for one piece of work on the live mesh must not be negative");
  if (!(o.max_translation_mm >= 0) || !(o.max_rotation_rad >= 0) || !(o.max_gain_change >= 0))
    throw Error("the live mesh's limits on changes must not be negative");
  if (o.warm_blocks < 1) throw Error("the live mesh needs at least one warm block");
}

}  // namespace

/// A change of patches becomes a change of the mesh in rounds. Only a finished round can be seen from
/// outside.
class IncrementalFusion::Impl {
 public:
  Impl(const FusionOptions& fusion, const IncrementalOptions& options)
      : budget_(options.budget_ms),
        field_(static_cast<float>(fusion.truncation_mm), static_cast<float>(fusion.min_weight)),
        places_(
            block_reach(static_cast<float>(fusion.voxel_size_mm), static_cast<float>(fusion.truncation_mm)),
            options),
        blocks_(field_, static_cast<float>(fusion.voxel_size_mm), options.warm_blocks) {}

  void set_patches(const std::vector<PosedSurface>& patches, double gradient_scale) {
    places_.declare(patches, gradient_scale);
  }

  bool work() {
    const auto end = Clock::now() + std::chrono::duration<double, std::milli>(budget_);
    do {
      if (!step()) return false;
    } while (Clock::now() < end);
    return true;
  }

  std::vector<MeshBlock> take_changed_blocks() {
    std::vector<MeshBlock> result;
    result.reserve(ready_.size());
    for (auto& [key, block] : ready_) result.push_back(std::move(block));
    ready_.clear();
    return result;
  }

 private:
  using Clock = std::chrono::steady_clock;
  enum class Phase { idle, sampling, placing, meshing };

  /// One small piece of work; false when there is none.
  bool step() {
    if (phase_ == Phase::idle) return begin_round();
    if (next_ == keys_.size()) {
      next_phase();
      return true;
    }
    const std::int64_t key = keys_[next_++];
    if (phase_ == Phase::sampling) blocks_.sample(key, following_);
    if (phase_ == Phase::placing) blocks_.place(key, following_);
    if (phase_ == Phase::meshing) {
      if (auto block = blocks_.mesh(key)) made_.push_back(std::move(*block));
    }
    return true;
  }

  bool begin_round() {
    if (const auto id = places_.newest_new()) {
      start(carry_over(*id));
      return true;
    }
    if (const auto id = moves_left_ > 0 ? places_.newest_changed() : std::nullopt) {
      carry_over(*id);
      --moves_left_;
      return true;
    }
    if (queue_.empty()) {
      queue_ = blocks_.take_dirty();
      std::reverse(queue_.begin(), queue_.end());  // taken from its end
    }
    if (!queue_.empty()) {
      const auto first =
          queue_.end() - static_cast<std::ptrdiff_t>(std::min(queue_.size(), blocks_per_round));
      std::vector<std::int64_t> keys(first, queue_.end());
      queue_.erase(first, queue_.end());
      start(std::move(keys));
      return true;
    }
    moves_left_ = moves_at_once;
    return places_.newest_changed().has_value();
  }

  /// Puts a patch where it should be; returns the blocks it passes through there.
  std::vector<std::int64_t> carry_over(int id) {
    const PlacedPatch before = places_.take_out(id);
    if (before.patch) blocks_.unlist(before);
    const PlacedPatch* now = places_.put_in(id);
    std::vector<std::int64_t> keys;
    if (!now || !now->patch) return keys;
    blocks_.list(*now);
    for (const PassedBlock& passed : now->blocks) keys.push_back(passed.key);
    return keys;
  }

  void start(std::vector<std::int64_t> keys) {
    sampled_ = keys;
    keys_ = std::move(keys);
    next_ = 0;
    phase_ = Phase::sampling;
  }

  void next_phase() {
    if (phase_ == Phase::meshing) return end_round();
    phase_ = phase_ == Phase::sampling ? Phase::placing : Phase::meshing;
    std::sort(following_.begin(), following_.end());
    following_.erase(std::unique(following_.begin(), following_.end()), following_.end());
    keys_ = std::move(following_);
    following_.clear();
    next_ = 0;
  }

  void end_round() {
    for (MeshBlock& block : made_) ready_.insert_or_assign(block.key, std::move(block));
    made_.clear();
    for (const std::int64_t key : sampled_) blocks_.drop_if_empty(key);
    phase_ = Phase::idle;
  }

  double budget_;
  Field field_;
  PatchPlaces places_;
  LiveBlocks blocks_;
  std::vector<std::int64_t> queue_;  ///< blocks that wait for a round
  int moves_left_ = moves_at_once;

  Phase phase_ = Phase::idle;
  std::vector<std::int64_t> sampled_;           ///< the round's blocks
  std::vector<std::int64_t> keys_, following_;  ///< of this phase, of the next one
  std::size_t next_ = 0;
  std::vector<MeshBlock> made_;
  std::map<std::int64_t, MeshBlock> ready_;
};

IncrementalFusion::IncrementalFusion(const FusionOptions& fusion, const IncrementalOptions& options) {
  check_options(fusion);
  check(options);
  impl_ = std::make_unique<Impl>(fusion, options);
}
IncrementalFusion::~IncrementalFusion() = default;
IncrementalFusion::IncrementalFusion(IncrementalFusion&&) noexcept = default;
IncrementalFusion& IncrementalFusion::operator=(IncrementalFusion&&) noexcept = default;

void IncrementalFusion::set_patches(const std::vector<PosedSurface>& patches, double gradient_scale) {
  impl_->set_patches(patches, gradient_scale);
}
bool IncrementalFusion::work() { return impl_->work(); }
std::vector<MeshBlock> IncrementalFusion::take_changed_blocks() { return impl_->take_changed_blocks(); }

}  // namespace gelslam
