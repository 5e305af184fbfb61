#pragma once

#include <cstdint>
#include <opencv2/core/mat.hpp>

namespace gelslam {

/// One picture from the sensor, already cropped and resized to the calibrated resolution (320x240 for a
/// GelSight Mini).
struct TactileImage {
  cv::Mat3b bgr;
  double time_s = 0.0;     ///< since the log's first frame
  std::int64_t index = 0;  ///< in the log, from 0; background frames count
};

}  // namespace gelslam
