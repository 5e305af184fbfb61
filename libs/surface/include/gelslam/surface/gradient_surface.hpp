#pragma once

#include <memory>
#include <opencv2/core/mat.hpp>

#include "gelslam/surface/surface.hpp"

namespace gelslam {

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
