#pragma once

#include <opencv2/core/mat.hpp>

namespace gelslam::surface::detail {

/// A channel at this gray level or above counts as saturated. It is less than 255 because JPEG darkens white
/// a little.
inline constexpr int kFullLevel = 250;

/// Dilates a mask (0 or 255) by the distance over which the lens and JPEG spread a spot.
void spread_spots(const cv::Mat1b& spots, cv::Mat1b& spread);

/// Replaces pixels whose color does not tell the slope of the gel, in two steps that are not in the papers:
///
/// 1. Wrong values, such as hot or dead pixels and bit errors. The lens blurs the picture over several
///    pixels, so a value far from the median of its 3x3 neighborhood cannot be right. It is replaced by that
///    median.
/// 2. Spots: highlights, and dirt on the lens or gel. A spot consists of pixels with two saturated channels,
///    of pixels in which all channels are brighter than the background by more than a slope can cause, and of
///    pixels in which all channels are less than half as bright as the background. (On real presses of three
///    sensors no pixel is below 0.74 of its background.) The spot is dilated by the blur of the lens, and the
///    difference between picture and background is interpolated over it from the pixels around it. A spot
///    then looks neither like a contact nor like texture. A spot that the background has, too, is left as it
///    is, since it causes no difference.
///
/// On a gel with printed dots (find_marker_dots), the dots are also interpolated in the background. The spots
/// of a picture are then the places of the dots in the background, and the pixels that are darker than the
/// gel without dots, because the printed dots move with the gel.
class PixelRepair {
 public:
  explicit PixelRepair(const cv::Mat3b& background);

  /// Returns the background without wrong values and markers.
  const cv::Mat3b& background() const { return background_; }
  /// Returns `bgr` itself if it has no damaged pixels, and else a repaired copy that is valid until the next
  /// call. `bgr` has the size of the background.
  const cv::Mat3b& clean(const cv::Mat3b& bgr);
  /// Returns the mask of the pixels (255) that the last clean() interpolated over spots; empty if there were
  /// none.
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
  cv::Mat3b dark_below_, bright_above_;  // limits of each pixel and channel, in gray levels
  cv::Mat1b dots_;                       // 255 at the background's printed dots; empty if it has none
  cv::Mat1b covered_;
  cv::Mat1b spots_, dark_, bright_;
  cv::Mat1b readable_;    // 1 where the color tells the slope, 0 in spots
  cv::Mat3f difference_;  // picture minus background in gray levels
  cv::Mat1f weight_;
  cv::Mat3b filled_;
};

}  // namespace gelslam::surface::detail
