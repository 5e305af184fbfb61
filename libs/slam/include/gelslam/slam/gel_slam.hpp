#pragma once

#include <cstdint>
#include <functional>
#include <vector>

#include "gelslam/core/bounded_queue.hpp"
#include "gelslam/core/progress.hpp"
#include "gelslam/core/stage_timer.hpp"
#include "gelslam/frontend/tracker.hpp"
#include "gelslam/slam/mapper.hpp"

namespace gelslam {

class Store;

/// Operations that write to the session, in the order of the queue.
using SessionQueue = BoundedQueue<std::function<void(Store&)>>;

/// GelSLAM (Huang et al., T-RO 2026; docs/algorithms.md lists the differences), frame by frame. Every scan,
/// live or offline, runs through this class. Its stages:
///
///   surface      picture to heights, normals, curvature, contact                    FrameToSurface
///   track        surface to pose relative to a keyframe; new keyframes (§IV)        track()
///   close loops  keyframe to motions relative to earlier keyframes there (§V)       close_loops()
///   optimize     motions to poses of the keyframes and gradient scale               finish()
///   fuse         surfaces at these poses to one mesh                                fuse_map()
///
/// There are two ways to run it, with the same results. Offline, one thread calls process(), which includes
/// the search for loops. Live, one thread calls track() and another one close_loops(). Of frames that are no
/// keyframes, only a FrameRecord is stored. Deterministic.
class GelSlam {
 public:
  /// `so_far` is the scan to continue; for a new scan it contains only the new part, if any. Loops of
  /// keyframes whose search was still outstanding are searched for in the constructor. `session` (may be
  /// null) receives everything that is measured.
  explicit GelSlam(const SlamOptions& options, const ScanRecord& so_far = {},
                   SessionQueue* session = nullptr);

  /// Calls track(), and close_loops() for each new keyframe.
  TrackedFrame process(std::int64_t frame, double time_s, SurfacePtr surface, StageTimer& timer,
                       std::int64_t unix_us = 0);
  /// To be called after the last frame: end_tracking(), and close_loops() for each new keyframe.
  void end_trial(StageTimer& timer);

  /// Tracks the next frame. `surface` is null for a frame of the background. Returns the frame's pose in its
  /// trial and the new keyframes.
  TrackedFrame track(std::int64_t frame, double time_s, SurfacePtr surface, StageTimer& timer,
                     std::int64_t unix_us = 0);
  /// Calls Tracker::end_trial().
  std::vector<NewKeyframe> end_tracking();
  /// Adds a keyframe to the map and searches for its loops. Keyframes must be passed in order. If `search` is
  /// false, the keyframe is added without a search, which takes no time.
  void close_loops(const NewKeyframe& added, StageTimer& timer, bool search = true);
  /// To be used only by the thread that calls close_loops().
  Mapper& mapper() { return mapper_; }

  /// All that was measured so far.
  ScanRecord measured() const { return mapper_.measured(frames_); }

  /// Solves the pose graph: poses of all keyframes in the frame of the map's anchor, with covariances. Must
  /// not be called while another function runs; more frames may follow. If `refine` is true, overlap edges
  /// are searched for first; if it is false, only the known edges are solved, which takes tenths of a second.
  /// `progress` (may be null) receives the task "closing loops". When `stop_requested` returns true, the rest
  /// of the overlap edges is skipped.
  SlamMap finish(
      bool refine = true, ProgressSink* progress = nullptr,
      const std::function<bool()>& stop_requested = [] { return false; }) const {
    return solve_scan(measured(), options_, refine, stop_requested, progress);
  }

 private:
  void keep(const std::vector<NewKeyframe>& keyframes);
  void keep_loops(int keyframe, const std::vector<PoseGraphEdge>& loops);

  SlamOptions options_;
  Tracker tracker_;
  Mapper mapper_;
  std::vector<FrameRecord> frames_;
  SessionQueue* session_;
};

}  // namespace gelslam
