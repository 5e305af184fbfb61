#pragma once

#include <atomic>
#include <memory>
#include <optional>
#include <variant>
#include <vector>

#include "gelslam/core/bounded_queue.hpp"
#include "gelslam/core/stage_timer.hpp"
#include "gelslam/sensor/frame_source.hpp"
#include "gelslam/sensor/raw_frame.hpp"
#include "gelslam/slam/gel_slam.hpp"
#include "gelslam/slam/live_slam.hpp"
#include "gelslam/slam/store.hpp"
#include "gelslam/slam/surface_stream.hpp"
#include "live/live_board.hpp"

namespace gelslam::slam::detail {

using RawFramePtr = std::shared_ptr<const RawFrame>;

/// From the surface stage to the tracker.
struct SurfacedFrame : SurfaceStream::Item {
  LiveClock::time_point arrived, captured;
};

/// Travels with the frames, so that it happens between two of them.
struct BreakTrial {};

using TrackerMessage = std::variant<SurfacedFrame, BreakTrial>;

/// What the stages of a live scan share.
struct LiveContext {
  LiveContext(const LiveOptions& live_options, const std::string& source)
      : options(live_options),
        so_far(options.continued ? options.continued->record : ScanRecord{}),
        board(source) {}

  const LiveOptions options;
  ScanRecord so_far;            ///< the scan that goes on; of a new one its part alone
  std::optional<GelSlam> slam;  ///< once the threads begin
  StageTimer timer;
  LiveBoard board;
  std::atomic<bool> aborted{false};
  std::atomic<bool> lost{false};  ///< the source, or its gel: the scan ends early

  static constexpr std::size_t kQueuedFrames = 2;  ///< what is older is not worth its latency
  BoundedQueue<RawFramePtr> raw{kQueuedFrames};
  BoundedQueue<TrackerMessage> surfaced{kQueuedFrames};
  BoundedQueue<NewKeyframe> keyframes{1};  ///< its limit is never asked for: the tracker goes beyond it
  SessionQueue measured{1};                ///< the same
};

}  // namespace gelslam::slam::detail
