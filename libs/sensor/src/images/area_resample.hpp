#pragma once

#include <opencv2/core/mat.hpp>

namespace gelslam::detail {

/// Averages each output pixel over the part of `window` it covers; pixel edges of `image` lie at whole
/// numbers, and the window's edges anywhere between them. Parts outside the image count as its border pixels.
/// The window must be at least as large as the output and overlap the image.
cv::Mat3b area_resample(const cv::Mat3b& image, const cv::Rect2d& window, cv::Size size);

}  // namespace gelslam::detail
