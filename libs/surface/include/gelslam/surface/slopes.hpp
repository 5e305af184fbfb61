#pragma once

#include <memory>
#include <opencv2/core/mat.hpp>

#include "gelslam/surface/gradient_model.hpp"
#include "gelslam/surface/surface.hpp"

namespace gelslam {

/// The gradient dh/dx, dh/dy of the height per pixel of the raw image (HxW, dimensionless), before
/// integration.
struct SlopeMap {
  cv::Mat1f gx, gy;
};

/// Returns the slopes that the model reads at every pixel of a picture, minus those that it reads in the
/// background. Changes of the light are not compensated. Throws Error when the sizes of the pictures differ.
SlopeMap read_slope_map(const GradientModel& model, const cv::Mat3b& bgr, const cv::Mat3b& background);

/// Makes surfaces from gradients and contact masks that are already known, as in the files gradient_maps.npy
/// and contact_masks.npy of the public TactileTracking data. All have the size of the camera. Not
/// thread-safe, because it keeps work buffers.
class GradientSurfaces {
 public:
  /// The pictures have at least 16x16 pixels.
  explicit GradientSurfaces(const CameraModel& camera);
  ~GradientSurfaces();

  /// Returns the surface of one frame. `gx`, `gy`: the gradient on the rectified grid (HxW, dimensionless),
  /// relative to the gel at rest; `touched`: the contact mask (HxW), not 0 where the object touches. The
  /// contact of the result is this mask, eroded by border(). Heights are relative to the gel at rest where
  /// the mask and the slopes show bare gel.
  SurfacePtr make(const cv::Mat1f& gx, const cv::Mat1f& gy, const cv::Mat1b& touched);

  /// Returns the structuring element with which contact masks are eroded: a square that reaches kRimMm to
  /// each side (rounded to pixels), about as in the public systems.
  static cv::Mat border(double pixel_pitch_mm);

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

/// The standard deviation of slopes at the best place of the gel for a model that does not state one.
inline constexpr double kBestSlopeSigmaRad = 0.05;

/// The standard deviation of the slopes that a gradient model reads, over the gel.
struct SlopeUncertainty {
  cv::Mat1f sigma_rad;  ///< in rad, one value per cell of a grid over the picture; the grid may have any size
};

/// Returns the uncertainty that is assumed for a model that does not state one (not in the papers). Because
/// balls are pressed at least their radius away from the border, the model extrapolates near the border, and
/// the standard deviation grows toward it.
SlopeUncertainty default_uncertainty(cv::Size picture, double pixel_pitch_mm);

/// Returns the uncertainty that the model states, or default_uncertainty().
SlopeUncertainty uncertainty_of(const GradientModel& model, cv::Size picture, double pixel_pitch_mm);

/// Returns the standard deviation at the best place of the gel divided by kBestSlopeSigmaRad, as in
/// Surface::slope_sigma_ratio.
double relative_sigma(const SlopeUncertainty& uncertainty);

/// Returns for each pixel 255 (s / sigma)², rounded and limited to 2 ... 255, where s is the smallest sigma
/// of the gel but at least kBestSlopeSigmaRad. This is Surface::confidence if the whole picture is contact.
cv::Mat1b confidence_map(const SlopeUncertainty& uncertainty, cv::Size picture);

/// Lowers Surface::confidence on slopes of more than 25 degrees. Networks read them too flat: the read slope
/// changes by less than the true slope, so the same noise of the read slope means a larger error of the true
/// slope.
void lower_steep_confidence(const cv::Mat3f& normals, cv::Mat1b& confidence);

/// Returns whether the normal of a pixel was measured: the pixel is in contact, and its normal was not
/// interpolated from other pixels.
bool is_read(const Surface& surface, cv::Point pixel);
/// Returns a mask, 255 where is_read() is true.
cv::Mat1b read_contact(const Surface& surface);

}  // namespace gelslam
