#pragma once

#include <opencv2/core/mat.hpp>

#include "gelslam/core/gradient_model.hpp"

namespace gelslam {

/// dh/dx and dh/dy per pixel (HxW, dimensionless), as SurfaceEstimator reads them before integration.
struct SlopeMap {
  cv::Mat1f gx, gy;
};

/// What the model reads at every pixel of a picture, less what it reads in the background; the light is not
/// followed. Throws Error when sizes differ or the model does not fit.
SlopeMap read_slope_map(const GradientModel& model, const cv::Mat3b& bgr, const cv::Mat3b& background);

}  // namespace gelslam
