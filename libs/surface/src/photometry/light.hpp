#pragma once

#include <array>
#include <opencv2/core/mat.hpp>
#include <vector>

namespace gelslam::surface::detail {

/// How the lamps and stray light differ from when the background was taken. In each channel untouched gel is
/// seen as
///   row_gain * (gain * background + offset + field(x, y) * (1 or background / 128)),
/// x and y from -1 to 1 over the picture. Stray light from one side adds a field, a lamp that fails on one
/// side multiplies by one, a lamp that flickers dims some rows of a rolling shutter.
struct Light {
  /// Gain and offset, then those of x, y, x², xy and y² of the field.
  using Coefficients = std::array<double, 7>;

  std::array<Coefficients, 3> channels{{{1.0}, {1.0}, {1.0}}};
  std::vector<double> row_gain;  ///< of each row of blocks, the same for all channels; empty: 1
  bool has_field = false;        ///< else only gain and offset are not 0
  bool field_multiplies = false;

  bool is_even() const { return !has_field && row_gain.empty(); }
};

/// For each channel and 8-bit value the gray level it would have had in the background's light.
using ColorTable = std::array<std::array<float, 256>, 3>;
ColorTable color_table(const Light& even_light);

/// A picture as it would have been in the background's light.
void to_background_light(const Light& light, const cv::Mat3b& bgr, cv::Mat3b& result);
/// Means of its blocks, in place.
void to_background_light(const Light& light, cv::Mat3f& means);

/// Follows the light from frame to frame by a robust fit (own): block means outside the last contact that
/// agree with the last light (or with gains by the median, where they explain clearly more blocks) are fitted
/// by least squares, up to three times over. Where gain and offset are hard to tell apart, the gain is 1, or
/// the median's where that explains clearly more blocks. Where even light explains little, a field and
/// flickering rows are tried as well. Keeps the last light where fewer than a tenth of the blocks agree.
class LightTracker {
 public:
  /// `uneven`: also look for a field and for rows. (A contact may look like one as long as its place is not
  /// known.)
  explicit LightTracker(const cv::Mat3f& background_blocks, bool uneven = false);

  /// `blocks`: block means of the frame; `touched`: 255 where the object touches (may be empty).
  const Light& update(const cv::Mat3f& blocks, const cv::Mat1b& touched);

 private:
  struct Fit {
    Light light;
    int agree = 0;  // blocks
  };

  int select_inliers(const cv::Mat3f& blocks, const cv::Mat1b& excluded, const Light& light, double gate);
  bool fit_even(const cv::Mat3f& blocks, const Light& expected, Light& light) const;
  bool fit_field(const cv::Mat3f& blocks, Light& light) const;
  Light fit_by_median(const cv::Mat3f& blocks, const cv::Mat1b& excluded) const;
  std::vector<double> fit_rows(const cv::Mat3f& blocks, const cv::Mat1b& excluded, const Light& light) const;
  Fit refine_even(const cv::Mat3f& blocks, const cv::Mat1b& excluded, const Light& expected, Light light);
  Fit refine_field(const cv::Mat3f& blocks, const cv::Mat1b& excluded, Light light, bool multiplies,
                   double gate);
  Fit refine_rows(const cv::Mat3f& blocks, const cv::Mat1b& excluded, Light light);
  Fit search(const cv::Mat3f& blocks, const cv::Mat1b& excluded, const Fit& followed);

  cv::Mat3f background_;
  bool may_be_uneven_;
  cv::Mat1b none_, inliers_;
  Light light_;
  /// Noise, too, makes few blocks agree: where a search found nothing better, this share of blocks agreed,
  /// and none is made again until clearly fewer do.
  double share_at_vain_search_ = 1.0;
};

}  // namespace gelslam::surface::detail
