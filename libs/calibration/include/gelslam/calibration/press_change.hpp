#pragma once

#include <opencv2/core/mat.hpp>

namespace gelslam {

/// Color difference of a press to the background, gray levels, without what all of the picture has in common
/// (another exposure). Both of one size.
cv::Mat3f press_change(const cv::Mat3b& bgr, const cv::Mat3b& background);

}  // namespace gelslam
