#pragma once

#include <opencv2/core/mat.hpp>
#include <vector>

#include "light.hpp"

namespace gelslam::surface::detail {

/// Height of the untouched gel: the median of `height` over pixels where `changed` is 0; where those are fewer than
/// 5 % of the image, the 85th percentile over all pixels.
float untouched_level(const cv::Mat1f& height, const cv::Mat1b& changed, std::vector<float>& scratch);

struct ContactRule {
  double color_dist_threshold = 15.0;  ///< grey levels
  double height_threshold_mm = 0.2;    ///< for deep contacts
};

/// Contact by colour and depth: colour distance above the threshold (dilated 7x7, eroded 15x15) and height_mm (0 on
/// the untouched gel) below a limit that follows the frame's depth: min(height_threshold, fraction of the deepest).
class ContactDetector {
 public:
  ContactDetector(cv::Size size, const ContactRule& rule);
  void detect(const cv::Mat3b& bgr, const cv::Mat3b& background, const ColorTable& colors, const cv::Mat1f& height_mm,
              cv::Mat1b& contact);

 private:
  ContactRule rule_;
  cv::Mat grow_, shrink_, border_;
  cv::Mat1b colored_, scratch_;
};

}  // namespace gelslam::surface::detail
