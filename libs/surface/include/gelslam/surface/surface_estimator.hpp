#pragma once

#include <memory>
#include <opencv2/core/mat.hpp>

#include "gelslam/surface/gradient_model.hpp"
#include "gelslam/surface/surface.hpp"

namespace gelslam {

struct SurfaceOptions {
  double pixel_pitch_mm = 0.0634;
  SensorOptics optics;  ///< where the model does not say its sensor's
  /// Follow lamps and stray light (own), per channel by gain, offset, and a smooth field.
  bool compensate_light = true;
  bool gradient_everywhere = false;  ///< unchanged pixels go through the network, too
};

/// Returns the camera whose pictures the model reads. Throws Error for optics that no sensor has.
CameraModel camera_of(const GradientModel& model, cv::Size picture, const SurfaceOptions& options);

/// Wall-clock milliseconds of one estimate(), by stage.
struct SurfaceTimings {
  double gradient_ms = 0.0;  ///< finding changed pixels and running the network on them
  double poisson_ms = 0.0;   ///< height and its zero level
  double contact_ms = 0.0;   ///< contact mask
  double normals_ms = 0.0;   ///< normals and curvature
};

/// Color -> gradient -> height, normals, contact, curvature (Huang et al., RA-L 2024, §III;
/// docs/algorithms.md). Not thread-safe: one estimator per thread (it keeps work buffers).
class SurfaceEstimator {
 public:
  /// `background`: mean of frames without contact, same size as every later image (at least 16x16).
  SurfaceEstimator(GradientModel model, const cv::Mat3b& background, const SurfaceOptions& options);
  ~SurfaceEstimator();
  SurfaceEstimator(SurfaceEstimator&&) noexcept;
  SurfaceEstimator& operator=(SurfaceEstimator&&) noexcept;

  /// Throws Error when the image's size differs from the background's.
  SurfacePtr estimate(const cv::Mat3b& bgr);

  /// Returns false where light changed over the last picture by more than is taken off.
  bool light_is_followed() const;

  /// Returns the timings of the last estimate().
  const SurfaceTimings& timings() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace gelslam
