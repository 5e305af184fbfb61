#pragma once

#include <opencv2/core/mat.hpp>
#include <vector>

#include "gelslam/surface/camera_model.hpp"

namespace gelslam::surface::detail {

/// Returns the box enlarged by a margin in pixels on all sides and clipped to the image. An empty box stays
/// empty.
cv::Rect grown(const cv::Rect& box, int margin, cv::Size image);

/// The uncertainty of the heights of one frame.
struct HeightQuality {
  double slope_noise_ratio = 1;  ///< Surface::slope_noise_ratio
  double slope_sigma_ratio = 1;  ///< Surface::slope_sigma_ratio
  float bare_scatter_mm = 0;     ///< standard deviation of the heights of bare gel
  /// If not, the object covers the picture, and the zero of heights is unknown.
  bool bare_gel_is_seen = true;
};

/// Finds the pixels in which the object presses the gel down. This model is not in the papers.
///
/// The gel is modeled as a stretched membrane on an elastic foundation. The pressure between gel and object,
/// divided by the stiffness of the foundation, is
///   p = d - L² Δd = d + L² c   (in mm),
/// where d is the depth below the gel at rest, c the Laplacian of the height (in 1/mm), and L the length over
/// which the gel beside an object returns to its level at rest. Beside the object, where the gel is only
/// draped, p = 0; under a flat face p = d; under a convex face p > d. A pixel is in contact if d exceeds the
/// error of the heights, and p exceeds d / 2 by the error of p. That error is a fraction of the largest
/// depth; without it, specks of bare gel beside 135 presses of real balls were taken for contact.
///
/// If no bare gel is seen, d is unknown, and the contact is where the color has changed. Small holes in the
/// contact are filled, because gel that a contact encloses is touched, too.
class ContactDetector {
 public:
  explicit ContactDetector(double pixel_pitch_mm);

  /// Computes `contact` (HxW, 0 or 255). `height_mm`: the height relative to the gel at rest, negative in
  /// contact; `curvature_per_px`: the divergence() of the gradient, in 1/pixel; `changed`: 255 where the
  /// picture differs from the background, which is used only if no bare gel is seen.
  void detect(const cv::Mat1f& height_mm, const cv::Mat1f& curvature_per_px, const cv::Mat1b& changed,
              const HeightQuality& quality, cv::Mat1b& contact);

 private:
  void close(const cv::Mat1b& below, cv::Mat1b& contact);

  double pitch_mm_;
  cv::Mat speck_;
  cv::Mat1f pressure_, blocks_;
  cv::Mat1b below_, holes_;
  std::vector<std::vector<cv::Point>> contours_;
  std::vector<cv::Vec4i> hierarchy_;  // the hierarchy of contours_, as OpenCV returns it
};

}  // namespace gelslam::surface::detail
