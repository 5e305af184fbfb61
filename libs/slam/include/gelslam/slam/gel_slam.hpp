#pragma once

#include <cstdint>
#include <memory>

#include "gelslam/core/progress.hpp"
#include "gelslam/core/stage_timer.hpp"
#include "gelslam/frontend/tracker.hpp"
#include "gelslam/slam/slam_map.hpp"
#include "gelslam/slam/slam_options.hpp"

namespace gelslam {

/// The chain from surfaces to a map, one frame after the other: tracker, then mapper. Only keyframes are
/// kept. Deterministic.
class GelSlam {
 public:
  /// `continued`: null for a new scan.
  explicit GelSlam(const SlamOptions& options, const ContinuedScan* continued = nullptr);
  ~GelSlam();
  GelSlam(GelSlam&&) noexcept;

  /// Tracks a frame and searches loops for the keyframe it may have made.
  TrackedFrame process(std::int64_t frame, double time_s, SurfacePtr surface, StageTimer& timer);

  /// Notes a frame that has no surface (background).
  void skip(std::int64_t frame, double time_s);

  /// Puts all poses right. May be called at any time; frames may follow. `refine` false: with the edges that
  /// are known, which takes tenths of a second. Tells `progress` (null: nobody) of the tasks "closing loops"
  /// and "calibrating slopes".
  SlamMap finish(bool refine = true, ProgressSink* progress = nullptr) const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace gelslam
