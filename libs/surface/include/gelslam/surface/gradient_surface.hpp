#pragma once

#include <memory>
#include <opencv2/core/mat.hpp>

#include "gelslam/core/gradient_model.hpp"
#include "gelslam/surface/surface.hpp"

namespace gelslam {

/// dh/dx and dh/dy per pixel (HxW, dimensionless), as SurfaceEstimator reads them before integration.
struct SlopeMap {
  cv::Mat1f gx, gy;
};

/// What the model reads at every pixel of a picture, less what it reads in the background; the light is not
/// followed. Throws Error when sizes differ or the model does not fit.
SlopeMap read_slope_map(const GradientModel& model, const cv::Mat3b& bgr, const cv::Mat3b& background);

/// Surfaces from gradients and contact masks that are known already (gradient_maps.npy and contact_masks.npy
/// of the public TactileTracking data), all of one size. Not thread-safe: it keeps work buffers.
class GradientSurfaces {
 public:
  /// `size` at least 16x16.
  GradientSurfaces(cv::Size size, double pixel_pitch_mm);
  ~GradientSurfaces();

  /// gx, gy: height per distance; `touched`: not 0 where the object touches, which is eroded by H/48 pixels
  /// as the public systems do. Zero height is the median where nothing touches.
  SurfacePtr make(const cv::Mat1f& gx, const cv::Mat1f& gy, const cv::Mat1b& touched);

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace gelslam
