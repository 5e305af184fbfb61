#pragma once

#include <Eigen/Core>
#include <opencv2/core/mat.hpp>

#include "gelslam/surface/surface.hpp"

namespace gelslam::registration::detail {

/// The factor by which the resolution of a surface is reduced along each axis before textures are compared.
/// This loses little, because the relevant textures are many pixels wide.
inline constexpr int kTextureShrink = 2;

/// The texture of a surface at a lower resolution, cropped to the contact: the curvature minus its mean over
/// the contact.
struct CoarseTexture {
  cv::Mat1f curvature;        ///< in 1/pixel of the surface; 0 outside the contact
  cv::Mat1f mask;             ///< 1 in the contact, else 0
  double pixels = 0;          ///< the number of pixels in the contact
  double pixel_pitch_mm = 0;  ///< mm per pixel at the lower resolution
  /// The vector from the center of the picture to the first pixel of the cropped maps, in their pixels.
  Eigen::Vector2d origin_px = Eigen::Vector2d::Zero();

  CoarseTexture() = default;
  explicit CoarseTexture(const Surface& surface, int shrink = kTextureShrink);
  /// Returns the texture rotated by an angle about the z axis of the sensor.
  CoarseTexture turned(double angle_rad) const;

 private:
  void crop_to_contact();
};

/// The Fourier transform of a texture, with which it can be correlated with another one at all shifts at
/// once. Both have to be padded to the same `size`, which is at least the sum of the sizes of the two
/// textures.
class TextureSpectrum {
 public:
  TextureSpectrum(const CoarseTexture& texture, cv::Size size);

  /// How well two textures agree for each shift of the second one. The value for the shift (x, y) in pixels
  /// is in column x and row y, and that for a negative shift at the index size + shift.
  struct Agreement {
    cv::Mat1f similarity;  ///< the normalized cross-correlation over the shared contact, -1..1
    cv::Mat1f shared;      ///< the number of pixels of the shared contact
  };
  Agreement correlated_with(const TextureSpectrum& other) const;

 private:
  cv::Mat curvature_, squared_, mask_;
};

}  // namespace gelslam::registration::detail
