#pragma once

#include <Eigen/Core>
#include <opencv2/core/mat.hpp>

#include "gelslam/surface/surface.hpp"

namespace gelslam::registration::detail {

/// The number of pixels of a surface, along an axis, per pixel that is compared: textures that matter are
/// many pixels wide.
inline constexpr int kTextureShrink = 2;

/// The curvature inside a contact without its mean, 0 outside, at a coarser resolution than the surface's.
struct CoarseTexture {
  cv::Mat1f curvature;  ///< 1/pixel of the surface
  cv::Mat1f mask;       ///< 1 in the contact, else 0
  double pixels = 0;    ///< sum of the mask
  double pixel_pitch_mm = 0;
  Eigen::Vector2d origin_px = Eigen::Vector2d::Zero();  ///< of the first pixel, from the picture's center

  CoarseTexture() = default;
  explicit CoarseTexture(const Surface& surface, int shrink = kTextureShrink);
  /// Returns the texture turned about the sensor's z axis.
  CoarseTexture turned(double angle_rad) const;

 private:
  void crop_to_contact();
};

/// The Fourier transform of a texture, by which it is compared with another one at all shifts at once. Both
/// are padded to the same `size`, the sum of the sizes of both textures.
class TextureSpectrum {
 public:
  TextureSpectrum(const CoarseTexture& texture, cv::Size size);

  /// How two textures agree when the second one is shifted. Shift (x, y) in pixels stands in column x and row
  /// y; negative shifts stand at the end, as size + shift.
  struct Agreement {
    cv::Mat1f similarity;  ///< normalized cross-correlation over what is shared, -1..1
    cv::Mat1f shared;      ///< pixels
  };
  Agreement correlated_with(const TextureSpectrum& other) const;

 private:
  cv::Mat curvature_, squared_, mask_;
};

}  // namespace gelslam::registration::detail
