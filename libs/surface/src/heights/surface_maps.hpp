#pragma once

#include <opencv2/core/mat.hpp>

#include "heights/poisson.hpp"

namespace gelslam::surface::detail {

/// Unit normals (-gx, -gy, 1) normalized.
cv::Mat3f normals_from_gradient(const cv::Mat1f& gx, const cv::Mat1f& gy);

/// Curvature as Surface has it, from the divergence of the solver's last gradients.
cv::Mat1f curvature_in_contact(const PoissonSolver& solved, const cv::Mat1b& contact);

}  // namespace gelslam::surface::detail
