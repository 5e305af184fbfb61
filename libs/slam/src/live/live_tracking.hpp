#pragma once

#include <mutex>
#include <vector>

#include "gelslam/core/stage_timer.hpp"
#include "gelslam/slam/slam_map.hpp"
#include "live/live_messages.hpp"
#include "pipeline/hidden_motions.hpp"

namespace gelslam::slam::detail {

/// Surfaces to poses; keyframes go on to the mapper, whose queue has no limit, so that this stage never
/// waits.
class TrackingStage {
 public:
  TrackingStage(const TrackerOptions& options, LiveBoard& board, StageTimer& timer)
      : options_(options), tracker_(options), board_(board), timer_(timer) {}

  void run(TrackerQueue& in, MapperQueue& out);

  /// What became of every frame of the present scan so far. Thread-safe.
  std::vector<FrameRecord> records() const;

 private:
  void handle(const SurfacedFrame& frame, MapperQueue& out);
  void handle(BreakTrial, MapperQueue&) { tracker_.break_trial(); }
  void handle(UndoTrial, MapperQueue& out);
  void handle(NewScan, MapperQueue& out);
  void handle(SaveNow, MapperQueue& out) { out.push_beyond_limit(SaveSoFar{records()}); }
  void record(const FrameRecord& record);

  const TrackerOptions options_;
  Tracker tracker_;
  HiddenMotions hidden_;
  LiveBoard& board_;
  StageTimer& timer_;
  int scan_ = 0;
  mutable std::mutex mutex_;
  std::vector<FrameRecord> records_;
};

}  // namespace gelslam::slam::detail
