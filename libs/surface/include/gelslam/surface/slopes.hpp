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

/// The standard deviation of slopes at the best place of the gel, of a model that states none.
inline constexpr double kBestSlopeSigmaRad = 0.05;

/// Standard deviation (rad) of the slopes that a color model reads, by place on the gel.
struct SlopeUncertainty {
  cv::Mat1f sigma_rad;  ///< one value per cell of a grid over the picture; the grid may have any size
};

/// Returns what is assumed of a model that does not state its uncertainty (own). Balls are pressed at least
/// their radius away from the border, so that the model extrapolates there: the standard deviation grows
/// toward the border of the picture.
SlopeUncertainty default_uncertainty(cv::Size picture, double pixel_pitch_mm);

/// Returns the model's own statement, or else the default.
SlopeUncertainty uncertainty_of(const GradientModel& model, cv::Size picture, double pixel_pitch_mm);

/// Returns the standard deviation at the best place of the gel over kBestSlopeSigmaRad, as in
/// Surface::slope_sigma_ratio.
double relative_sigma(const SlopeUncertainty& uncertainty);

/// Returns 255 (best / sigma)² of every pixel, 2 to 255: Surface::confidence where all is contact. The best
/// is the least sigma, at least kBestSlopeSigmaRad.
cv::Mat1b confidence_map(const SlopeUncertainty& uncertainty, cv::Size picture);

/// Lowers Surface::confidence where networks read slopes too flat: the less what they read follows the true
/// slope, the more its noise weighs.
void lower_steep_confidence(const cv::Mat3f& normals, cv::Mat1b& confidence);

/// Says whether the picture shows the object there: it is contact, and was not filled in from around.
bool is_read(const Surface& surface, cv::Point pixel);
/// Returns a mask, 255 where is_read() is true.
cv::Mat1b read_contact(const Surface& surface);

}  // namespace gelslam
