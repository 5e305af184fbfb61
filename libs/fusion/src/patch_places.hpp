#pragma once

#include <map>
#include <memory>
#include <optional>
#include <set>
#include <vector>

#include "blocks.hpp"
#include "gelslam/fusion/incremental_fusion.hpp"
#include "patch.hpp"

namespace gelslam::fusion::detail {

using PatchPtr = std::shared_ptr<const Patch>;

/// A patch that is in the mesh, with the data from which it was computed.
struct PlacedPatch {
  PosedSurface posed;
  double gradient_scale = 1.0;
  PatchPtr patch;                   ///< Null if the patch has no contact.
  std::vector<PassedBlock> blocks;  ///< Blocks through which it passes.
};

/// Keeps track of the patches that should be in the mesh and of those that are, with their poses.
class PatchPlaces {
 public:
  PatchPlaces(const BlockReach& reach, const IncrementalOptions& options)
      : reach_(reach), options_(options) {}

  /// See IncrementalFusion::set_patches().
  void declare(const std::vector<PosedSurface>& patches, double gradient_scale);

  /// Return the newest patch that is new, and the newest one that has moved too far, was removed, or arrived
  /// together with many others.
  std::optional<int> newest_new() const { return newest(new_); }
  std::optional<int> newest_changed() const { return newest(changed_); }

  /// Returns all patches that are new or have changed.
  std::vector<int> all_changed() const;

  /// Update one patch in three steps. take_out() removes and returns the placed patch (without a patch if
  /// there was none). make() prepares it at its new pose and reuses the pixels of `before` if only the pose
  /// changed; the result has no patch if the patch should be removed. It may be called from several threads.
  /// put_in() stores the result. If make() throws, an empty result is stored.
  PlacedPatch take_out(int id);
  PlacedPatch make(int id, const PlacedPatch& before) const;
  void put_in(int id, PlacedPatch now);

  void forget() { *this = PatchPlaces(reach_, options_); }

 private:
  static std::optional<int> newest(const std::set<int>& ids) {
    return ids.empty() ? std::nullopt : std::optional<int>(*ids.rbegin());
  }
  bool stale(const PlacedPatch& placed, const PosedSurface& wanted) const;

  BlockReach reach_;
  IncrementalOptions options_;
  std::map<int, PosedSurface> wanted_;
  double gradient_scale_ = 1.0;
  std::map<int, PlacedPatch> placed_;
  std::set<int> new_, changed_;
};

}  // namespace gelslam::fusion::detail
