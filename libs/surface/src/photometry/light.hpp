#pragma once

#include <array>
#include <opencv2/core/mat.hpp>
#include <span>
#include <vector>

namespace gelslam::surface::detail {

/// How the lamps and stray light differ from when the background was taken. In each channel untouched gel is
/// seen as row_gain times the sum of coefficient * background^b * x^i * y^j over kLightTerms, x and y from -1
/// to 1 over the picture. A lamp that changes on one side or stray light gives the terms of x and y, a lamp
/// that flickers dims some rows of a rolling shutter.
struct Light {
  using Coefficients = std::array<double, 6>;

  /// Gain, offset, then a field that multiplies and one that adds.
  std::array<Coefficients, 3> channels{{{1.0}, {1.0}, {1.0}}};
  std::vector<double> row_gain;  ///< of each row of blocks, the same for all channels; empty: 1

  bool is_even() const;  ///< only gain and offset differ
};

/// Powers of the background and of the place. The order is that of plausibility: what an earlier term
/// explains is not explained by a later one.
struct LightTerm {
  std::size_t background, x, y;
};
inline constexpr std::array<LightTerm, 6> kLightTerms{
    {{1, 0, 0}, {0, 0, 0}, {1, 1, 0}, {1, 0, 1}, {0, 1, 0}, {0, 0, 1}}};

/// For each channel and 8-bit value the gray level it would have had in the background's light.
using ColorTable = std::array<std::array<float, 256>, 3>;
ColorTable color_table(const Light& even_light);

/// A picture as it would have been in the background's light.
void to_background_light(const Light& light, const cv::Mat3b& bgr, cv::Mat3b& result);
/// Means of its blocks, in place.
void to_background_light(const Light& light, cv::Mat3f& means);

/// Follows the light from frame to frame (own): a regression of block means outside the last contact on the
/// background's, iteratively reweighted (Tukey) from the last light. Each term is shrunk by how little of the
/// change it explains (positive-part James-Stein), to none where the blocks do not demand it. Where gain and
/// offset leave too many blocks unexplained, the medians, the field and flickering rows are tried as well.
/// Keeps the last light where fewer than a tenth of the blocks agree.
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

  int weigh(const Light& light, double limit);
  bool regress(Light& light, std::span<const std::size_t> order) const;
  Fit fit(Light light, std::span<const std::size_t> order, double widening);
  Light median_gains() const;
  std::vector<double> median_rows(const Light& light) const;
  Fit search(const Fit& followed);

  cv::Mat3f background_;
  bool may_be_uneven_;
  std::vector<float> x_;  // of each column
  cv::Mat1b none_;
  cv::Mat3f blocks_;    // of this frame
  cv::Mat1b excluded_;  // of this frame
  cv::Mat1f weights_;
  Light light_;
  /// Noise, too, makes few blocks agree: where a search found nothing better, this share of blocks agreed,
  /// and none is made again until clearly fewer do.
  double share_at_vain_search_ = 1.0;
};

}  // namespace gelslam::surface::detail
