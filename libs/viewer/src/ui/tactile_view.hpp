#pragma once

#include <opencv2/core/mat.hpp>

#include "gelslam/slam/live_session.hpp"

namespace gelslam::viewer::detail {

/// The camera's picture with the border of the contact drawn over it: what the sensor sees, and what counts
/// as touched. BGR, `width_px` wide. A picture without a surface (before the background is known) is shown as
/// it is.
cv::Mat3b tactile_picture(const LiveTouch& touch, int width_px, const cv::Vec3b& outline_bgr);

/// Normals as colors (x red, y green, z blue, as is usual), BGR; what is not touched is faded toward gray.
cv::Mat3b normal_picture(const Surface& surface, int width_px);

}  // namespace gelslam::viewer::detail
