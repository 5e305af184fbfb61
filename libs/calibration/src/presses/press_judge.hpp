#pragma once

#include <opencv2/core/mat.hpp>
#include <string>

#include "gelslam/calibration/circle_finder.hpp"

namespace gelslam::calibration::detail {

struct JudgedPress {
  FoundCircle found;
  std::string problem;  ///< what the hand should do better, for people; "" when the press is good
};

/// Is a picture of a still ball fit for a calibration? `difference`: of its cells to the bare gel's;
/// `touch_level`: what counts as touched there.
JudgedPress judge_press(const cv::Mat3b& bgr, const cv::Mat3b& background, const cv::Mat1f& difference,
                        double touch_level, double ball_px);

}  // namespace gelslam::calibration::detail
