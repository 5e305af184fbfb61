#include "patch_places.hpp"

#include <cmath>
#include <iterator>
#include <string>
#include <utility>

#include "gelslam/core/error.hpp"

namespace gelslam::fusion::detail {
namespace {

constexpr std::size_t kMaxNew = 3;  ///< Each new patch takes one call of work() for itself.

}  // namespace

void PatchPlaces::declare(const std::vector<PosedSurface>& patches, double gradient_scale) {
  check_gradient_scale(gradient_scale);
  std::map<int, PosedSurface> wanted;
  for (const PosedSurface& posed : patches) {
    check_patch(posed);
    if (!wanted.emplace(posed.id, posed).second)
      throw Error("cannot fuse keyframe " + std::to_string(posed.id) + ": it is given twice");
  }
  wanted_ = std::move(wanted);
  gradient_scale_ = gradient_scale;
  const std::set<int> waiting = std::move(changed_);
  new_.clear();
  changed_.clear();
  for (const auto& [id, posed] : wanted_) {
    const auto placed = placed_.find(id);
    if (placed == placed_.end())
      (waiting.contains(id) ? changed_ : new_).insert(id);
    else if (stale(placed->second, posed))
      changed_.insert(id);
  }
  // If many patches come at once, because another component is shown, they are processed together like moved
  // ones.
  while (new_.size() > kMaxNew) changed_.insert(new_.extract(new_.begin()));
  for (const auto& [id, placed] : placed_)
    if (!wanted_.contains(id)) changed_.insert(id);
}

bool PatchPlaces::stale(const PlacedPatch& placed, const PosedSurface& wanted) const {
  if (!(placed.posed.surface == wanted.surface)) return true;
  if (std::fabs(gradient_scale_ / placed.gradient_scale - 1.0) > options_.max_scale_change) return true;
  const Pose& from = placed.posed.map_T_keyframe;
  const Pose& to = wanted.map_T_keyframe;
  if ((to.translation() - from.translation()).norm() > options_.max_displacement_mm) return true;
  // R - S| = 2 sqrt(2) sin(angle / 2). This is accurate for small angles, unlike the arc cosine of the trace.
  const double chord = (to.linear() - from.linear()).norm();
  const SurfaceFacts facts = wanted.surface.facts();
  const double corner_mm = 0.5 * facts.pixel_pitch_mm * std::hypot(facts.size.width, facts.size.height);
  return corner_mm * chord / std::sqrt(2.0) > options_.max_displacement_mm;
}

std::vector<int> PatchPlaces::all_changed() const {
  std::vector<int> ids;
  std::set_union(new_.begin(), new_.end(), changed_.begin(), changed_.end(), std::back_inserter(ids));
  return ids;
}

PlacedPatch PatchPlaces::take_out(int id) {
  new_.erase(id);
  changed_.erase(id);
  auto node = placed_.extract(id);
  return node ? std::move(node.mapped()) : PlacedPatch{};
}

PlacedPatch PatchPlaces::make(int id, const PlacedPatch& before) const {
  PlacedPatch now;
  const auto wanted = wanted_.find(id);
  if (wanted == wanted_.end()) return now;
  now.posed = wanted->second;
  now.gradient_scale = gradient_scale_;
  const bool same_pixels =
      before.patch && before.posed.surface == now.posed.surface && before.gradient_scale == gradient_scale_;
  std::optional<Patch> patch = same_pixels ? before.patch->moved_to(now.posed.map_T_keyframe)
                                           : Patch::prepare(now.posed, gradient_scale_);
  if (!patch) return now;
  now.blocks = blocks_of(patch->opened(), reach_);
  now.patch = std::make_shared<const Patch>(std::move(*patch));
  return now;
}

void PatchPlaces::put_in(int id, PlacedPatch now) {
  const auto wanted = wanted_.find(id);
  if (wanted == wanted_.end()) return;
  if (!now.patch) now = {wanted->second, gradient_scale_, nullptr, {}};
  placed_[id] = std::move(now);
}

}  // namespace gelslam::fusion::detail
