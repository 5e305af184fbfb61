#pragma once

#include <opencv2/core/mat.hpp>
#include <vector>

namespace gelslam {

/// Mean of images of one size, rounded to the nearest grey level. Throws Error when there are none or sizes differ.
cv::Mat3b mean_image(const std::vector<cv::Mat3b>& images);

}  // namespace gelslam
