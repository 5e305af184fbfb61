#pragma once

#include <opencv2/core/mat.hpp>

namespace gelslam::surface::detail {

/// A channel at this level or above is full: JPEG takes a little off white.
inline constexpr int kFullLevel = 250;

/// Replaces pixels that do not show the gel (own), in two steps.
/// Wrong values, such as hot or dead pixels and lost bits: a lens blurs what the gel shows over several
/// pixels, so a value far from the median of its 3x3 neighbors is replaced by that median.
/// Highlights and opaque spots: pixels of which two channels are full, or of which all are less than half as
/// bright as in the background, do not tell how steep the gel is. Their difference to the background, and
/// that of the neighbors into which the lens spreads them, is filled in from around, so that a spot is
/// neither a contact nor a texture. What the background shows itself is left alone. (On the real presses of
/// three sensors no pixel is below 0.74 of its background.)
class PixelRepair {
 public:
  explicit PixelRepair(const cv::Mat3b& background);

  /// The background without wrong values.
  const cv::Mat3b& background() const { return background_; }
  /// `bgr` itself where nothing is wrong; else a copy, valid until the next call.
  const cv::Mat3b& clean(const cv::Mat3b& bgr);

 private:
  const cv::Mat3b& replace_wrong_values(const cv::Mat3b& bgr);
  bool find_spots(const cv::Mat3b& bgr);
  const cv::Mat3b& fill_spots(const cv::Mat3b& bgr);

  cv::Mat3b median_, median_difference_;
  cv::Mat3b background_;
  cv::Mat3b dark_from_, dark_limit_;  // what is between is a dark spot
  cv::Mat1b is_full_in_background_;
  cv::Mat1b spots_, dark_;
  cv::Mat1b readable_;  // 1 where colors tell the slope, else 0
  cv::Mat3f difference_;
  cv::Mat1f weight_;
  cv::Mat3b filled_;
};

}  // namespace gelslam::surface::detail
