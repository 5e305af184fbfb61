#pragma once

#include <opencv2/core/mat.hpp>

namespace gelslam::viewer::detail {

/// What the press changed: the difference to the bare gel around mid-gray, stretched so that nearly all of it
/// (99 %) fits. What the whole picture has in common (another exposure) is taken off. Both of one size.
cv::Mat3b difference_picture(const cv::Mat3b& bgr, const cv::Mat3b& background);

}  // namespace gelslam::viewer::detail
