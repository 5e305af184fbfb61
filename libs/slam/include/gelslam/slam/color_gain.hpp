#pragma once

#include <array>
#include <opencv2/core.hpp>

namespace gelslam {

/// Multiplies a picture's channels; values beyond white stay white.
class ColorGain {
 public:
  explicit ColorGain(const std::array<double, 3>& gain_bgr)
      : unchanged_(gain_bgr == std::array<double, 3>{1.0, 1.0, 1.0}) {
    for (int value = 0; value < 256; ++value)
      for (int channel = 0; channel < 3; ++channel)
        table_(0, value)[channel] =
            cv::saturate_cast<unsigned char>(value * gain_bgr[static_cast<std::size_t>(channel)]);
  }

  void apply(cv::Mat3b& bgr) const {
    if (!unchanged_) cv::LUT(bgr, table_, bgr);
  }

 private:
  bool unchanged_;
  cv::Mat3b table_ = cv::Mat3b(1, 256);
};

}  // namespace gelslam
