#pragma once

#include <opencv2/core/mat.hpp>

namespace gelslam::surface::detail {

/// A channel at this gray level or above is taken as saturated, because JPEG darkens white a little.
inline constexpr int kFullLevel = 250;

/// Dilates spots by the distance over which the lens and JPEG spread them.
void spread_spots(const cv::Mat1b& spots, cv::Mat1b& spread);

/// Replaces pixels that do not show the gel, in two steps, which are not in the papers.
/// First, wrong values, such as hot or dead pixels and lost bits. A lens blurs the picture over several
/// pixels, so a value that is far from the median of its 3x3 neighbors is wrong, and is replaced by that
/// median. Second, highlights and opaque spots. A pixel with two saturated channels, or with all channels
/// brighter than the background by more than slopes explain, or less than half as bright, does not show the
/// slope of the gel. Its difference to the background is interpolated from the pixels around, and so are its
/// neighbors, into which the lens spreads the spot. A spot is therefore neither a contact nor a texture.
/// Spots that the background has, too, are left unchanged. (On the real presses of three sensors no pixel is
/// below 0.74 of its background.)
///
/// On a gel with printed dots (find_marker_dots) the background is interpolated under them, too. The spots of
/// a picture are then the pixels that are darker than the gel without dots, wherever its dots have moved to,
/// and the places of the dots in the background.
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
