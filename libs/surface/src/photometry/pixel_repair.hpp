#pragma once

#include <opencv2/core/mat.hpp>

namespace gelslam::surface::detail {

/// A channel at this level or above is full: JPEG takes a little off white.
inline constexpr int kFullLevel = 250;

/// Widens spots to where lens and JPEG spread them.
void spread_spots(const cv::Mat1b& spots, cv::Mat1b& spread);

/// Replaces pixels that do not show the gel (own), in two steps.
/// Wrong values, such as hot or dead pixels and lost bits: a lens blurs what the gel shows over several
/// pixels, so a value far from the median of its 3x3 neighbors is replaced by that median.
/// Highlights and opaque spots: pixels of which two channels are full, or of which all are brighter than the
/// background by more than slopes explain, or less than half as bright, do not tell how steep the gel is.
/// Their difference to the background, and that of the neighbors into which the lens spreads them, is filled
/// in from around, so that a spot is neither a contact nor a texture. What the background shows itself is
/// left alone. (On the real presses of three sensors no pixel is below 0.74 of its background.)
///
/// Markers: on a gel with printed dots (find_marker_dots) the background is filled in under them, too. A
/// picture's spots are then what is darker than the gel without dots, wherever its dots have moved, and the
/// places of the dots in the background.
class PixelRepair {
 public:
  explicit PixelRepair(const cv::Mat3b& background);

  /// Returns the background without wrong values and markers.
  const cv::Mat3b& background() const { return background_; }
  /// Returns `bgr` itself where nothing is wrong; else a copy, valid until the next call.
  const cv::Mat3b& clean(const cv::Mat3b& bgr);
  /// Returns, of the last picture, 255 where it was filled in; empty: nowhere.
  const cv::Mat1b& covered() const { return covered_; }

 private:
  void fill_background(const cv::Mat1b& dots);
  void smooth_filled(int rounds);
  const cv::Mat3b& replace_wrong_values(const cv::Mat3b& bgr);
  cv::Vec3f gain_of_light(const cv::Mat3b& bgr) const;
  bool find_spots(const cv::Mat3b& bgr);
  const cv::Mat3b& fill_spots(const cv::Mat3b& bgr, int smooth_rounds);

  cv::Mat3b median_, median_difference_;
  cv::Mat3b background_;
  cv::Mat3b dark_below_, bright_above_;  // of each channel
  cv::Mat1b dots_;                       // of the background; empty without markers
  cv::Mat1b covered_;
  cv::Mat1b spots_, dark_, bright_;
  cv::Mat1b readable_;  // 1 where colors tell the slope, else 0
  cv::Mat3f difference_;
  cv::Mat1f weight_;
  cv::Mat3b filled_;
};

}  // namespace gelslam::surface::detail
