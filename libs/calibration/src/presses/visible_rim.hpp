#pragma once

#include <opencv2/core/mat.hpp>
#include <optional>

#include "gelslam/calibration/press_set.hpp"

namespace gelslam::calibration::detail {

/// The edge that people see around a contact: along rays from the middle, where the color change falls most
/// steeply outside of its greatest, and the circle through those places (robust). `knee` is the circle inside
/// which the gel lies on the ball. Nothing when too little of the edge is in the picture, or when it is no
/// circle about there: then the knee is the better guide.
std::optional<ContactCircle> find_visible_rim(const cv::Mat3f& relative_change, const ContactCircle& knee);

}  // namespace gelslam::calibration::detail
