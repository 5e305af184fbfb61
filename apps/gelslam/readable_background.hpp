#pragma once

#include <functional>
#include <opencv2/core/mat.hpp>
#include <string>

namespace gelslam {

/// Throws Error for a background on which no calibration can be built: a gel with markers, red and blue
/// swapped. Other doubts about it are said. `name`: of the background, for people.
void require_readable_background(const cv::Mat3b& background, const std::string& device_name,
                                 const std::string& name,
                                 const std::function<void(const std::string&)>& say_doubt);

}  // namespace gelslam
