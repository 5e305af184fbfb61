#pragma once

#include <opencv2/core.hpp>

namespace gelslam::test {

/// What `value(u, v)` says of each pixel.
template <typename Pixel, typename Value>
cv::Mat_<Pixel> pixel_map(const cv::Size& size, Value&& value) {
  cv::Mat_<Pixel> map(size);
  for (int v = 0; v < size.height; ++v)
    for (int u = 0; u < size.width; ++u) map(v, u) = static_cast<Pixel>(value(u, v));
  return map;
}

}  // namespace gelslam::test
