#pragma once

#include <array>
#include <opencv2/core/mat.hpp>
#include <vector>

namespace gelslam::surface::detail {

/// Stray light from one side adds to the picture, a lamp that fails on one side dims it, one that flickers
/// dims some rows.
enum class Unevenness { none, added, multiplied, banded };

using Gains = std::array<double, 3>;

/// How the lamps and stray light differ from when the background was taken: per channel, seen = gain * then +
/// offset, and + field (added) or + field * then / 128 (multiplied), or all that times row_gain (banded).
/// Untouched gel keeps its colour otherwise, so all follow from the untouched part of one frame.
struct Light {
  Gains gain{1.0, 1.0, 1.0};
  std::array<double, 3> offset{0.0, 0.0, 0.0};  ///< grey levels
  /// Grey levels times x, y, x², xy, y²; x and y go from -1 to 1 over the picture.
  std::array<std::array<double, 5>, 3> field{};
  std::vector<double> row_gain{};              ///< of each row of blocks; the same for all channels
  Unevenness unevenness = Unevenness::none;  ///< none: no field and no rows
};

/// For each channel and 8-bit value the grey level it would have had in the background's light, but for the
/// field.
using ColorTable = std::array<std::array<float, 256>, 3>;
ColorTable color_table(const Light& light);

/// A picture, or mean colours of its blocks, as they were without the field.
void remove_field(const Light& light, const cv::Mat3b& bgr, cv::Mat3b& even);
void remove_field(const Light& light, cv::Mat3f& means);

/// Mean colours as they would have been in the background's light, but for the field, in place.
void to_background_light(const Light& light, cv::Mat3f& means);

/// Follows the light from frame to frame by a robust fit (own): block means outside the last contact that
/// agree with the last light (or with a shift or a gain by the median, where that explains clearly more
/// blocks) are fitted by least squares, three times over. Keeps the last light where fewer than a tenth of
/// the blocks agree.
class LightTracker {
 public:
  /// `uneven`: also look for light from one side or in bands, where light that is the same everywhere
  /// explains little. (A contact may look like that, too, as long as it is not known where it is.)
  explicit LightTracker(const cv::Mat3f& background_blocks, bool uneven = false);

  /// `blocks`: block means of the frame; `excluded`: 255 where the object touches (may be empty).
  const Light& update(const cv::Mat3f& blocks, const cv::Mat1b& excluded);

 private:
  struct Fit {
    Light light;
    int agree = 0;  // blocks
  };

  int select_inliers(const cv::Mat3f& blocks, const cv::Mat1b& excluded, const Light& light, double gate);
  template <int terms>
  bool fit(const cv::Mat3f& blocks, Unevenness unevenness, const Gains& expected, Light& light) const;
  Light fit_by_median(const cv::Mat3f& blocks, const cv::Mat1b& excluded, bool as_gain) const;
  Fit refine_even(const cv::Mat3f& blocks, const cv::Mat1b& excluded, Light light);
  Fit refine_uneven(const cv::Mat3f& blocks, const cv::Mat1b& excluded, Light light, Unevenness unevenness,
                    double gate);
  std::vector<double> fit_rows(const cv::Mat3f& blocks, const cv::Mat1b& excluded, const Light& light) const;
  Fit refine_banded(const cv::Mat3f& blocks, const cv::Mat1b& excluded, Light light);
  Fit search(const cv::Mat3f& blocks, const cv::Mat1b& excluded, const Fit& followed);

  cv::Mat3f background_;
  bool may_be_uneven_;
  cv::Mat1b inliers_;
  Light light_;
  /// Noise, too, makes few blocks agree: where a search found nothing better, this share did, and none is
  /// made again until clearly fewer do.
  double vain_share_ = 1.0;
};

}  // namespace gelslam::surface::detail
