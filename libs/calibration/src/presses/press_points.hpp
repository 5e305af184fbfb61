#pragma once

#include <opencv2/core/mat.hpp>

#include "gelslam/calibration/press_set.hpp"
#include "training/press_fit.hpp"

namespace gelslam::calibration::detail {

/// A press's change (press_change) relative to the background's brightness, a little smoothed.
cv::Mat3f relative_change(const cv::Mat3f& change, const cv::Mat3b& background);

/// About `wanted` points of it on a grid around a contact, its membrane rim and some bare gel included.
PressPoints points_around(const ContactCircle& contact, const cv::Mat3f& relative, double wanted);

}  // namespace gelslam::calibration::detail
