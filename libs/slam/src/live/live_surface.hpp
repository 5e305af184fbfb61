#pragma once

#include <deque>
#include <optional>

#include "gelslam/core/stage_timer.hpp"
#include "gelslam/sensor/frame_source.hpp"
#include "gelslam/slam/live_slam.hpp"
#include "gelslam/slam/surface_stream.hpp"
#include "live/live_messages.hpp"

namespace gelslam::slam::detail {

/// Raw frames to surfaces. While the first frames show contact, the user is told to take the object away.
class SurfaceStage {
 public:
  /// Throws Error when the model or the background image cannot be read.
  SurfaceStage(const LiveOptions& options, LiveBoard& board, StageTimer& timer);

  void run(RawQueue& in, TrackerQueue& out);
  /// LiveSlam::background_frames(); after run().
  BackgroundFrames background_frames() const;

 private:
  std::optional<TactileImage> decode(const RawFrame& frame);
  void report_background();

  LiveBoard& board_;
  StageTimer& timer_;
  FrameDecoder decoder_;
  FrameToSurface frames_;
  const std::size_t most_background_frames_;
  std::deque<RawFramePtr> background_frames_;  // the newest ones, until they are accepted
};

}  // namespace gelslam::slam::detail
