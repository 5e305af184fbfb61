#pragma once

#include <opencv2/core/mat.hpp>

namespace gelslam::surface::detail {

/// Returns the divergence d(gx)/dx + d(gy)/dy of a gradient (HxW) in 1/pixel, by central differences. It
/// equals the Laplacian of the height. At the border, differences are taken to the replicated last pixel.
cv::Mat1f divergence(const cv::Mat1f& gx, const cv::Mat1f& gy);

/// Returns the unit normals (-gx, -gy, 1) / sqrt(1 + gx² + gy²).
cv::Mat3f normals_from_gradient(const cv::Mat1f& gx, const cv::Mat1f& gy);

/// Returns Surface::curvature (1/pixel): the map `bend` from divergence(), smoothed, limited to
/// kMaxCurvaturePerMm, and 0 outside the contact. `unread`: 255 at pixels where the divergence is meaningless
/// because gradients were filled in there; they get 0 and have no influence on their neighbors. May be empty.
cv::Mat1f curvature_in_contact(const cv::Mat1f& bend, const cv::Mat1b& contact, double pixel_pitch_mm,
                               const cv::Mat1b& unread = {});

}  // namespace gelslam::surface::detail
