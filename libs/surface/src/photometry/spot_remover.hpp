#pragma once

#include <opencv2/core/mat.hpp>

namespace gelslam::surface::detail {

/// Takes highlights and opaque spots out of a picture. A pixel of which two channels are full, and are not in
/// the background, or of which all are less than half as bright as there, does not say how steep the gel is,
/// and neither do its neighbors, into which the lens spreads it. How they differ from the background is
/// filled in from around, so that a spot is neither a contact nor a texture. (Own; on the real presses of
/// three sensors no pixel is below 0.74.)
class SpotRemover {
 public:
  explicit SpotRemover(const cv::Mat3b& background);

  /// `bgr` itself where it has none; else a copy without, valid until the next call.
  const cv::Mat3b& clean(const cv::Mat3b& bgr);

 private:
  bool find(const cv::Mat3b& bgr);

  cv::Mat3f background_;
  cv::Mat3b dark_from_, dark_limit_;
  cv::Mat1b bright_background_, spots_, dark_;
  cv::Mat1b read_;  // 1 where colors tell the slope, else 0
  cv::Mat full_;
  cv::Mat3f difference_;
  cv::Mat1f weight_;
  cv::Mat3b cleaned_;
};

}  // namespace gelslam::surface::detail
