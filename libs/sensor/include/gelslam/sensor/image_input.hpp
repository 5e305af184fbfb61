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

/// Brings an image to the profile's resolution. It is unchanged if it has that size; cropped and resized if
/// it has the raw size; and resized if it is larger, has about that aspect ratio, and the profile says
/// `cropped`. Cropping removes 1/7 of the image on each side, and then what is needed to keep width:height
/// (evenly, an odd pixel at the top or left), as in the public systems. They resize bilinearly, which
/// aliases; this function averages over areas. Throws Error for every other size; `name` identifies the
/// image.
cv::Mat3b fit_to_profile(const cv::Mat3b& image, const SensorProfile& profile, const std::string& name);

/// Multiplies the channels of an image; values are limited to white.
class ColorGain {
 public:
  explicit ColorGain(const std::array<double, 3>& gain_bgr);
  void apply(cv::Mat3b& bgr) const;

 private:
  bool unchanged_;
  cv::Mat3b table_ = cv::Mat3b(1, 256);
};

}  // namespace gelslam
