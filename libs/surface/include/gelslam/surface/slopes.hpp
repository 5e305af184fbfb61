#pragma once

#include <memory>
#include <opencv2/core/mat.hpp>

#include "gelslam/surface/gradient_model.hpp"
#include "gelslam/surface/surface.hpp"

namespace gelslam {

/// Holds dh/dx and dh/dy per pixel (HxW, dimensionless), as SurfaceEstimator reads them before integration.
struct SlopeMap {
  cv::Mat1f gx, gy;
};

/// Returns the slopes that the model reads at every pixel of a picture, less those it reads in the
/// background. Changes of the light are not compensated. Throws Error when sizes differ or the model does not
/// fit.
SlopeMap read_slope_map(const GradientModel& model, const cv::Mat3b& bgr, const cv::Mat3b& background);

/// Makes surfaces from gradients and contact masks that are known already (gradient_maps.npy and
/// contact_masks.npy of the public TactileTracking data), all of one size. Not thread-safe: it keeps work
/// buffers.
class GradientSurfaces {
 public:
  /// The pictures have at least 16x16 pixels.
  explicit GradientSurfaces(const CameraModel& camera);
  ~GradientSurfaces();

  /// gx, gy: slopes on the rectified grid, relative to the gel at rest; `touched`: not 0 where the object
  /// touches, which is eroded. Zero height is the median where nothing touches.
  SurfacePtr make(const cv::Mat1f& gx, const cv::Mat1f& gy, const cv::Mat1b& touched);

  /// Returns what contacts are eroded with: a square of H/48 pixels around each, as in the public systems.
  static cv::Mat border(double pixel_pitch_mm);

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

/// The standard deviation of slopes at the best place of the gel for a model that does not state one.
inline constexpr double kBestSlopeSigmaRad = 0.05;

/// Standard deviation (rad) of the slopes that a color model reads, by place on the gel.
struct SlopeUncertainty {
  cv::Mat1f sigma_rad;  ///< one value per cell of a grid over the picture; the grid may have any size
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

/// Returns 255 (best / sigma)² of every pixel, 2 to 255: Surface::confidence where all is contact. The best
/// is the least sigma, at least kBestSlopeSigmaRad.
cv::Mat1b confidence_map(const SlopeUncertainty& uncertainty, cv::Size picture);

/// Lowers Surface::confidence on steep slopes. Networks read them too flat: a change of the true slope
/// changes the read slope by less, so the read slope's noise is a larger error of the true slope.
void lower_steep_confidence(const cv::Mat3f& normals, cv::Mat1b& confidence);

/// Says whether the normal of a pixel was measured: it is in the contact, and was not interpolated from
/// others.
bool is_read(const Surface& surface, cv::Point pixel);
/// Returns a mask, 255 where is_read() is true.
cv::Mat1b read_contact(const Surface& surface);

}  // namespace gelslam
