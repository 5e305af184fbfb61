#pragma once

#include <opencv2/core/mat.hpp>

namespace gelslam::surface::detail {

/// Takes highlights out of a picture: a pixel of which two channels are full, and are not in the background,
/// no longer says how steep the gel is, and neither do its neighbours, into which the lens spreads it. What
/// they differ from the background is filled in from around, so that a highlight is neither a contact nor a
/// texture. (Own.)
class GlareRemover {
 public:
  explicit GlareRemover(const cv::Mat3b& background);

  /// `bgr` itself where it has none; else a copy without, valid until the next call.
  const cv::Mat3b& clean(const cv::Mat3b& bgr);

 private:
  bool find(const cv::Mat3b& bgr);

  cv::Mat3f background_;
  cv::Mat1b bright_, read_;  // read_: 1 where colours tell the slope, else 0
  cv::Mat full_;
  cv::Mat3f difference_;
  cv::Mat1f weight_;
  cv::Mat3b cleaned_;
};

}  // namespace gelslam::surface::detail
