#pragma once

#include <opencv2/core/mat.hpp>

namespace gelslam::surface::detail {

/// Takes single wrong pixels out of a picture (own): hot or dead ones of an imager, bits lost on the way. A
/// lens blurs what the gel shows over several pixels, so a value that is far from the median of its 3x3
/// neighbors was not seen.
class ImpulseRemover {
 public:
  /// The picture itself where it has none, which a look at every fourth row tells; else valid until the next
  /// call.
  const cv::Mat3b& clean(const cv::Mat3b& bgr);

 private:
  cv::Mat3b median_, difference_;
};

}  // namespace gelslam::surface::detail
