#pragma once

#include <opencv2/core/mat.hpp>

namespace gelslam::surface::detail {

/// Where an image differs from the background by more than noise: pixels around which the 5x5 mean of the signed
/// colour difference is longer than a threshold, grown by a margin. The mean keeps what shallow slopes do to the
/// colour (it has one sign over many pixels) and removes what white noise does (factor 5).
class ChangeDetector {
 public:
  ChangeDetector(const cv::Mat3b& background, double threshold_gray_levels, int margin_px);

  /// Fills difference and changed. All HxW.
  void detect(const cv::Mat3b& bgr);

  const cv::Mat1b& changed() const { return changed_; }          ///< 255 or 0
  const cv::Mat3s& difference() const { return difference_; }    ///< image minus background, grey levels

 private:
  cv::Mat3s background_;
  int squared_threshold_of_sum_;
  cv::Mat kernel_;
  cv::Mat3s difference_;
  cv::Mat3s sum_;
  cv::Mat1b core_, changed_;
};

}  // namespace gelslam::surface::detail
