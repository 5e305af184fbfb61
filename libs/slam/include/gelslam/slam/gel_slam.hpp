#pragma once

#include <cstdint>
#include <functional>
#include <vector>

#include "gelslam/core/progress.hpp"
#include "gelslam/core/stage_timer.hpp"
#include "gelslam/frontend/tracker.hpp"
#include "gelslam/slam/mapper.hpp"

namespace gelslam {

/// GelSLAM (Huang et al., T-RO 2026; what differs: docs/algorithms.md), frame by frame. Its stages:
///
///   surface      picture to heights, normals, curvature, contact                    SurfaceStream
///   track        surface to pose relative to a keyframe; new keyframes (§IV)        Tracker
///   close loops  keyframe to motions relative to earlier keyframes there (§V)       LoopCloser
///   optimize     motions to poses of the keyframes and gradient scale               solve_pose_graph()
///   fuse         surfaces at these poses to one mesh                                fuse_map()
///
/// process() tracks and closes loops, finish() optimizes; the first and the last stage are called beside it
/// (as reconstruct() does). Only keyframes are kept. Deterministic.
class GelSlam {
 public:
  /// `so_far`: the scan that goes on; of a new one nothing but its part, if it has one.
  explicit GelSlam(const SlamOptions& options, const ScanRecord& so_far = {});

  /// Track, close loops. `surface`: of the next frame; null: it belongs to the background. Returns its pose
  /// in its trial, and the keyframes made of it.
  TrackedFrame process(std::int64_t frame, double time_s, SurfacePtr surface, StageTimer& timer,
                       std::int64_t unix_us = 0);

  /// After the last frame: what was touched last becomes a keyframe, if none shows it yet.
  void end_trial(StageTimer& timer);

  /// Optimize: all keyframes' poses in the frame of the map's anchor, and how well they are known. May be
  /// called at any time; frames may follow. `refine` true: with overlap edges; false: with the edges that are
  /// known, which takes tenths of a second. `progress` (may be null) receives the task "closing loops".
  /// `stop_requested` leaves out the rest of the overlap edges.
  SlamMap finish(
      bool refine = true, ProgressSink* progress = nullptr,
      const std::function<bool()>& stop_requested = [] { return false; }) const {
    return mapper_.finish(frames_, refine, stop_requested, progress);
  }

 private:
  void add(const std::vector<NewKeyframe>& keyframes, StageTimer& timer);

  Tracker tracker_;
  Mapper mapper_;
  std::vector<FrameRecord> frames_;
};

}  // namespace gelslam
