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

/// What is to be written into the session, in this order.
using SessionQueue = BoundedQueue<std::function<void(Store&)>>;

/// GelSLAM (Huang et al., T-RO 2026; what differs: docs/algorithms.md), frame by frame: the body of every
/// scan. Its stages:
///
///   surface      picture to heights, normals, curvature, contact                    FrameToSurface
///   track        surface to pose relative to a keyframe; new keyframes (§IV)        track()
///   close loops  keyframe to motions relative to earlier keyframes there (§V)       close_loops()
///   optimize     motions to poses of the keyframes and gradient scale               finish()
///   fuse         surfaces at these poses to one mesh                                fuse_map()
///
/// There are two schedules. Offline one thread calls process(), which waits for loops. Live one thread calls
/// track() and another one close_loops(). Their results are the same. Of frames that are no keyframes only a
/// FrameRecord is kept. Deterministic.
class GelSlam {
 public:
  /// `so_far`: the scan that goes on; of a new one nothing but its part, if it has one. Searches the loops
  /// that it has left. `session` (may be null) is given what is measured.
  explicit GelSlam(const SlamOptions& options, const ScanRecord& so_far = {},
                   SessionQueue* session = nullptr);

  /// track(), and close_loops() for the keyframes.
  TrackedFrame process(std::int64_t frame, double time_s, SurfacePtr surface, StageTimer& timer,
                       std::int64_t unix_us = 0);
  /// After the last frame: end_tracking(), and close_loops() for the keyframes.
  void end_trial(StageTimer& timer);

  /// `surface`: of the next frame; null: it belongs to the background. Returns its pose in its trial, and the
  /// keyframes made of it.
  TrackedFrame track(std::int64_t frame, double time_s, SurfacePtr surface, StageTimer& timer,
                     std::int64_t unix_us = 0);
  /// Tracker::end_trial().
  std::vector<NewKeyframe> end_tracking();
  /// Keyframes in order. Without `search` the keyframe is added alone, which takes no time.
  void close_loops(const NewKeyframe& added, StageTimer& timer, bool search = true);
  /// Of the thread that closes loops.
  Mapper& mapper() { return mapper_; }

  /// All that was measured so far.
  ScanRecord measured() const { return mapper_.measured(frames_); }

  /// Optimize: all keyframes' poses in the frame of the map's anchor, and how well they are known. May be
  /// called while no other function is; frames may follow. `refine` true: with overlap edges; false: with the
  /// edges that are known, which takes tenths of a second. `progress` (may be null) receives the task
  /// "closing loops". `stop_requested` leaves out the rest of the overlap edges.
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
