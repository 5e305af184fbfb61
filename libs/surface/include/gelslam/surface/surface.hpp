#pragma once

#include <memory>
#include <opencv2/core/mat.hpp>

namespace gelslam {

/// Curvatures are clipped there, 1/pixel: a crease as sharp as the gel shows one.
inline constexpr float kMaxCurvature = 0.7F;

/// What the gel's surface looks like in one frame. All maps are HxW, continuous, in the sensor frame:
/// x right, y down, z out of the gel toward the object, origin at the image center on the undeformed gel.
/// Pixel (u,v) lies at x = (u - W/2 + 1/2) * pitch, y = (v - H/2 + 1/2) * pitch.
struct Surface {
  cv::Mat1f height_mm;  ///< 0 where nothing touches, negative in contact
  cv::Mat3f normals;    ///< unit, (-gx, -gy, 1) normalized; z > 0
  cv::Mat1b contact;    ///< 255 where the object touches, else 0
  /// Information that the normals carry, 255 (best / sigma)² (confidence_map()), at least 1 in contact and 0
  /// elsewhere; empty: the same all over the contact.
  cv::Mat1b confidence;
  cv::Mat1f
      curvature;  ///< smoothed Laplacian of height (1/pixel), 0 outside contact, clipped to +-kMaxCurvature
  double pixel_pitch_mm = 0.0634;
  /// Standard deviation of slopes at the best place as the color model states it, over what is assumed of a
  /// model that states none.
  double model_sigma = 1.0;
  int contact_pixels = 0;  ///< number of set pixels in `contact`
  /// Bare gel was seen, so that height 0 is where it lies. Else heights are right among themselves only.
  bool zero_is_bare_gel = true;
};

using SurfacePtr = std::shared_ptr<const Surface>;

}  // namespace gelslam
