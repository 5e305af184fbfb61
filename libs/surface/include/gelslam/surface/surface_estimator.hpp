#pragma once

#include <memory>
#include <opencv2/core/mat.hpp>

#include "gelslam/surface/gradient_model.hpp"
#include "gelslam/surface/surface.hpp"

namespace gelslam {

/// Options of SurfaceEstimator.
struct SurfaceOptions {
  double pixel_pitch_mm = 0.0634;  ///< mm per pixel in the plane z = 0
  SensorOptics optics;             ///< used if the model does not state the optics of its sensor
  /// If set, changes of the lamps and stray light are estimated and compensated: a gain and an offset per
  /// channel and a smooth field. This is not in the papers.
  bool compensate_light = true;
  bool gradient_everywhere = false;  ///< run the network also on pixels that have not changed
};

/// Returns the camera model of the sensor, with the optics of the gradient model or else those of the
/// options. Throws Error for optics that no sensor can have.
CameraModel camera_of(const GradientModel& model, cv::Size picture, const SurfaceOptions& options);

/// The durations of the stages of one estimate() in milliseconds of wall-clock time.
struct SurfaceTimings {
  double gradient_ms = 0.0;  ///< finding the pixels that have changed, and running the network on them
  double poisson_ms = 0.0;   ///< integrating the heights, and correcting them by the bare gel
  double contact_ms = 0.0;   ///< finding the contact
  double normals_ms = 0.0;   ///< computing normals and curvature
};

/// Computes the surface of the gel (height, normals, contact, curvature) from pictures: a network reads the
/// gradient from the colors, and the gradient is integrated (Huang et al., NormalFlow, RA-L 2024, §III;
/// docs/algorithms.md). The light is followed from frame to frame, so pictures have to come in their order.
/// Not thread-safe, because it keeps work buffers: use one estimator per thread.
class SurfaceEstimator {
 public:
  /// `background`: a picture of the bare gel (see background_image()), of at least 16x16 pixels and of the
  /// size of all later pictures. Throws Error if it is smaller, or if the optics are impossible.
  SurfaceEstimator(GradientModel model, const cv::Mat3b& background, const SurfaceOptions& options);
  ~SurfaceEstimator();
  SurfaceEstimator(SurfaceEstimator&&) noexcept;
  SurfaceEstimator& operator=(SurfaceEstimator&&) noexcept;

  /// Returns the surface of one picture. Throws Error if its size differs from that of the background.
  SurfacePtr estimate(const cv::Mat3b& bgr);

  /// Returns false if, in the last picture, the light had changed in a way that could not be compensated.
  bool light_is_followed() const;

  /// Returns the timings of the last estimate().
  const SurfaceTimings& timings() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace gelslam
