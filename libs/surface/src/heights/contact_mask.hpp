#pragma once

#include <opencv2/core/mat.hpp>
#include <vector>

#include "gelslam/surface/camera_model.hpp"

namespace gelslam::surface::detail {

/// The box with a margin, within the image; an empty one stays empty.
cv::Rect grown(const cv::Rect& box, int margin, cv::Size image);

/// The uncertainty of the heights of one frame.
struct HeightQuality {
  double slope_noise_ratio = 1;  ///< Surface::slope_noise_ratio
  double slope_sigma_ratio = 1;  ///< Surface::slope_sigma_ratio
  float bare_scatter_mm = 0;     ///< standard deviation of the heights of bare gel
  bool bare_gel_is_seen =
      true;  ///< otherwise the object covers the picture, and the zero of heights is unknown
};

/// Finds the gel that the object presses down. The model is not in the papers.
///
/// The gel is modeled as a stretched membrane on an elastic foundation. In units of the foundation's
/// stiffness its pressure on the object is
///   p = d - L² Δd = d + L² c,
/// with d the depth below the gel at rest, c the curvature (the Laplacian of the height) and L the length
/// over which the gel returns to rest beside an object. Beside the object p is 0; under a flat face p equals
/// d, and under a convex one it is larger. A pixel is in contact where d exceeds its error and p exceeds half
/// of d by the error of p. The error of p is a share of the largest depth; without it, islands beside 135
/// presses of real balls were taken as contact. Where no bare gel is seen, d is unknown, and the contact is
/// where the color has changed. Small holes of the contact are filled, because the gel that a contact
/// encloses is touched.
class ContactDetector {
 public:
  explicit ContactDetector(double pixel_pitch_mm);

  /// `height_mm`: relative to the gel at rest, negative in contact; `curvature_per_px`: divergence() of the
  /// slopes; `changed`: where the picture differs from the background, read where no bare gel is seen. Fills
  /// `contact` (HxW, 0 or 255).
  void detect(const cv::Mat1f& height_mm, const cv::Mat1f& curvature_per_px, const cv::Mat1b& changed,
              const HeightQuality& quality, cv::Mat1b& contact);

 private:
  void close(const cv::Mat1b& below, cv::Mat1b& contact);

  double pitch_mm_;
  cv::Mat speck_;
  cv::Mat1f pressure_, blocks_;
  cv::Mat1b below_, holes_;
  std::vector<std::vector<cv::Point>> contours_;
  std::vector<cv::Vec4i> hierarchy_;  // of the contours
};

}  // namespace gelslam::surface::detail
