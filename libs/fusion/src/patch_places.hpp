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

/// Which patches there should be, and which are in the mesh and where.
class PatchPlaces {
 public:
  PatchPlaces(const BlockReach& reach, const IncrementalOptions& options)
      : reach_(reach), options_(options) {}

  /// IncrementalFusion::set_patches.
  void declare(const std::vector<PosedSurface>& patches, double gradient_scale);

  /// The newest patch that has just come and is not yet in the mesh; that has moved too far, is gone, or came
  /// with many others.
  std::optional<int> newest_new() const { return newest(new_); }
  std::optional<int> newest_changed() const { return newest(changed_); }

  /// Brings one of them up to date: `take_out` forgets where it was (nothing when it was not there),
  /// `put_in` puts it where it should be (null when it should not). Both have to be called, in this order.
  PlacedPatch take_out(int id);
  const PlacedPatch* put_in(int id);

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
  PlacedPatch last_out_;  ///< its pixels serve again when it only moves
};

}  // namespace gelslam::fusion::detail
