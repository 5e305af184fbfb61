#pragma once

#include <cstdint>
#include <opencv2/core/mat.hpp>
#include <vector>

namespace gelslam::simulation::detail {

/// A JPEG with full color resolution (4:4:4). OpenCV 4.6 halves it, and color is what this sensor measures
/// with. Throws Error on an empty picture or when memory runs out.
std::vector<std::uint8_t> encode_jpeg(const cv::Mat3b& bgr, int quality);

}  // namespace gelslam::simulation::detail
