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

/// A patch as the mesh holds it.
struct PlacedPatch {
  PosedSurface posed;
  double gradient_scale = 1.0;
  PatchPtr patch;                   ///< null when it shows nothing
  std::vector<PassedBlock> blocks;  ///< that it passes through
};

/// Bookkeeping: the patches that should be in the mesh, and those that are, with their places.
class PatchPlaces {
 public:
  PatchPlaces(const BlockReach& reach, const IncrementalOptions& options)
      : reach_(reach), options_(options) {}

  /// IncrementalFusion::set_patches.
  void declare(const std::vector<PosedSurface>& patches, double gradient_scale);

  /// The newest patch that is new; the newest that has moved too far, is gone, or arrived with many others.
  std::optional<int> newest_new() const { return newest(new_); }
  std::optional<int> newest_changed() const { return newest(changed_); }

  /// Those and all others that have changed.
  std::vector<int> all_changed() const;

  /// Brings one of them up to date: `take_out` returns and forgets what was placed (without a patch when
  /// nothing was); `make` prepares it at its new place, reusing the pixels of `before` if it only moves
  /// (without a patch when it should not be there; may be called from several threads); `put_in` notes it as
  /// placed. A patch that make() refuses is put in without one.
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
