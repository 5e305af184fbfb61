#pragma once

#include <opencv2/core/mat.hpp>

#include "gelslam/surface/surface.hpp"

namespace gelslam::registration::detail {

/// Pixels of a surface per pixel that is compared: textures that matter are many pixels wide.
inline constexpr int kTextureShrink = 2;  // numerics

/// The curvature inside a contact without its mean, 0 outside, at a coarser resolution than the surface's.
struct CoarseTexture {
  cv::Mat1f curvature;  ///< 1/pixel of the surface
  cv::Mat1f mask;       ///< 1 in the contact, else 0
  double pixels = 0;    ///< sum of the mask
  double pixel_pitch_mm = 0;

  CoarseTexture() = default;
  explicit CoarseTexture(const Surface& surface, int shrink = kTextureShrink);
  /// Turned about the sensor's z axis.
  CoarseTexture turned(double angle_rad) const;
  /// To the contact, where no other texture has to be of the same size.
  void crop();

 private:
  void remove_mean();
};

/// The Fourier transform of a texture, to compare it with another of the same size at all shifts at once.
class TextureSpectrum {
 public:
  explicit TextureSpectrum(const CoarseTexture& texture);

  /// How two textures agree when the second one is shifted. Shift (x, y) in pixels stands in column x and row
  /// y; negative shifts stand at the end, as size + shift.
  struct Agreement {
    cv::Mat1f similarity;  ///< normalized cross-correlation over what is shared, -1..1
    cv::Mat1f shared;      ///< pixels
  };
  Agreement laid_on(const TextureSpectrum& other) const;

 private:
  cv::Mat curvature_, squared_, mask_;
};

}  // namespace gelslam::registration::detail
