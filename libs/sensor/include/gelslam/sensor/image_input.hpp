#pragma once

#include <array>
#include <filesystem>
#include <opencv2/core/mat.hpp>
#include <string>

#include "gelslam/sensor/sensor_profile.hpp"

namespace gelslam {

/// Reads one color image (png, jpg, bmp; 8 bits per channel; an alpha channel is dropped) at its own
/// size. Throws Error when the file is missing, is no image, is truncated or has no color.
cv::Mat3b read_image(const std::filesystem::path& path);

/// Brings a frame to the profile's resolution: kept as it is when it has that size, cropped and resized when
/// it has the raw size, resized when it is larger, of about that shape, and the profile says `cropped`. A
/// crop takes off 1/7 of the image on each side, then whatever keeps width:height (evenly, an odd pixel at
/// the top or left), as the public systems do; but they resize bilinearly, which aliases, and this by area
/// averaging. Throws Error for every other size; `name` says which image.
cv::Mat3b fit_to_profile(const cv::Mat3b& image, const SensorProfile& profile, const std::string& name);

/// Multiplies a picture's channels; values beyond white stay white.
class ColorGain {
 public:
  explicit ColorGain(const std::array<double, 3>& gain_bgr);
  void apply(cv::Mat3b& bgr) const;

 private:
  bool unchanged_;
  cv::Mat3b table_ = cv::Mat3b(1, 256);
};

}  // namespace gelslam
