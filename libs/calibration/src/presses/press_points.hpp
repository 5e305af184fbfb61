#pragma once

#include <opencv2/core/mat.hpp>
#include <optional>

#include "gelslam/calibration/press_set.hpp"
#include "training/press_fit.hpp"

namespace gelslam::calibration::detail {

/// A press's change (press_change) relative to the background's brightness, a little smoothed.
cv::Mat3f relative_change(const cv::Mat3f& change, const cv::Mat3b& background);

/// About `wanted` points of it on a grid around a contact, its membrane rim and some bare gel included.
PressPoints points_around(const ContactCircle& contact, const cv::Mat3f& relative, double wanted);

/// The edge that people see around a contact: along rays from the middle, where the color change falls most
/// steeply outside of its greatest, and the circle through those places (robust). `knee` is the circle inside
/// which the gel lies on the ball. Nothing when too little of the edge is in the picture, or when it is no
/// circle about there: then the knee is the better guide.
std::optional<ContactCircle> find_visible_rim(const cv::Mat3f& relative_change, const ContactCircle& knee);

}  // namespace gelslam::calibration::detail
