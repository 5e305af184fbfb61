#pragma once

#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "gelslam/sensor/frame_decoder.hpp"
#include "gelslam/slam/color_gain.hpp"
#include "gelslam/slam/config.hpp"

namespace gelslam {

/// Looks at a recording's first frames, which should show the bare gel, and says what makes it doubt them:
/// while the person can still begin again.
class StartCheck {
 public:
  StartCheck(const Config& config, std::function<void(const std::string&)> say_doubt);
  /// Every frame in order; does nothing after the first few.
  void look_at(const RawFrame& frame);

 private:
  void judge();

  Config config_;
  ColorGain color_gain_;
  std::function<void(const std::string&)> say_doubt_;
  std::optional<FrameDecoder> decoder_;  ///< gone once all is said
  std::vector<cv::Mat3b> pictures_;
};

}  // namespace gelslam
