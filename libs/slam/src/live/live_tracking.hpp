#pragma once

#include <mutex>
#include <optional>
#include <vector>

#include "gelslam/core/stage_timer.hpp"
#include "gelslam/slam/pose_stream.hpp"
#include "gelslam/slam/slam_map.hpp"
#include "gelslam/slam/slam_options.hpp"
#include "gelslam/slam/trial_drift.hpp"
#include "live/live_messages.hpp"

namespace gelslam::slam::detail {

/// Surfaces to poses; keyframes go on to the mapper, whose queue has no limit, so that this stage never
/// waits.
class TrackingStage {
 public:
  /// `relocalization_share`: Tracker::limit_relocalization(), or nothing. `so_far`: the scan that
  /// goes on. `stream`: null for none.
  TrackingStage(const SlamOptions& options, std::optional<double> relocalization_share,
                const ScanRecord& so_far, PoseStream* stream, SessionQueue& session, LiveBoard& board,
                StageTimer& timer);

  void run(TrackerQueue& in, MapperQueue& out);

  /// What became of every frame so far. Thread-safe.
  std::vector<FrameRecord> records() const;

 private:
  void handle(const SurfacedFrame& frame, MapperQueue& out);
  void handle(BreakTrial, MapperQueue&) { tracker_.break_trial(); }
  void handle(UndoTrial, MapperQueue& out);
  void handle(SaveNow, MapperQueue& out) { out.push_beyond_limit(SaveSoFar{records()}); }
  void record(const FrameRecord& record);
  void stream(const TrackedFrame& tracked, const SurfacedFrame& frame);

  const ScanRecord& so_far_;
  Tracker tracker_;
  PoseStream* stream_;
  HiddenMotions hidden_;
  LiveBoard& board_;
  StageTimer& timer_;
  SessionQueue& session_;
  const std::int64_t first_frame_;
  const double first_time_s_;
  mutable std::mutex mutex_;
  std::vector<FrameRecord> records_;
};

}  // namespace gelslam::slam::detail
