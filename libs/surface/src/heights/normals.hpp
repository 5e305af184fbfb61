#pragma once

#include <opencv2/core/mat.hpp>

namespace gelslam::surface::detail {

/// Returns the divergence of gradients (HxW), 1/pixel: inside the image the central difference d(gx)/dx +
/// d(gy)/dy, hence the Laplacian of height.
cv::Mat1f divergence(const cv::Mat1f& gx, const cv::Mat1f& gy);

/// Returns unit normals (-gx, -gy, 1) normalized.
cv::Mat3f normals_from_gradient(const cv::Mat1f& gx, const cv::Mat1f& gy);

/// Returns curvature as Surface has it, of divergence(). `unread`: pixels whose gradients, or their
/// neighbors', say nothing (255): 0 there, and left out of smoothing; empty: none.
cv::Mat1f curvature_in_contact(const cv::Mat1f& bend, const cv::Mat1b& contact, double pixel_pitch_mm,
                               const cv::Mat1b& unread = {});

}  // namespace gelslam::surface::detail
