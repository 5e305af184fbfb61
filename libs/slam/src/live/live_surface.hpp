#pragma once

#include <deque>
#include <filesystem>
#include <optional>

#include "gelslam/core/stage_timer.hpp"
#include "gelslam/sensor/frame_decoder.hpp"
#include "gelslam/slam/color_gain.hpp"
#include "gelslam/slam/config.hpp"
#include "gelslam/surface/surface_estimator.hpp"
#include "live/live_messages.hpp"

namespace gelslam::slam::detail {

/// Raw frames to surfaces. The first frames become the background: as many in a row as the configuration
/// wants, without contact; until they come, a person is told to take the object away.
class SurfaceStage {
 public:
  /// Throws Error when the model or the background image cannot be read.
  SurfaceStage(const Config& config, const std::filesystem::path& background, bool force, LiveBoard& board,
               StageTimer& timer);

  void run(RawQueue& in, TrackerQueue& out);

 private:
  std::optional<TactileImage> decode(const RawFrame& frame);
  void gather_background(const TactileImage& image);
  SurfacePtr estimate(const TactileImage& image);

  const Config config_;
  const bool force_;
  LiveBoard& board_;
  StageTimer& timer_;
  FrameDecoder decoder_;
  ColorGain color_gain_;
  GradientModel model_;
  std::deque<cv::Mat3b> waiting_;  // candidates for the background
  std::optional<SurfaceEstimator> estimator_;
};

}  // namespace gelslam::slam::detail
