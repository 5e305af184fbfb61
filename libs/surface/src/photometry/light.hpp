#pragma once

#include <array>
#include <opencv2/core/mat.hpp>

namespace gelslam::surface::detail {

/// Says how the light differs from when the background was taken. In each channel untouched gel is seen as
/// the sum of coefficient * background^b * field^f over kLightTerms: gain and offset of the whole picture,
/// and stray light, a shadow or a lamp that flickers while a shutter rolls, of one color and anywhere.
struct Light {
  using Coefficients = std::array<double, 4>;

  std::array<Coefficients, 3> channels{{{1.0}, {1.0}, {1.0}}};
  cv::Mat1f field;  ///< of blocks, smooth; empty: none

  bool is_even() const { return field.empty(); }  ///< only gain and offset differ
};

/// Powers of the background and of the field. The order is that of plausibility: what an earlier term
/// explains is not explained by a later one.
struct LightTerm {
  std::size_t background, field;
};
inline constexpr std::array<LightTerm, 4> kLightTerms{{{1, 0}, {0, 0}, {1, 1}, {0, 1}}};

/// Holds for each channel and 8-bit value the gray level it would have had in the background's light.
using ColorTable = std::array<std::array<float, 256>, 3>;
ColorTable color_table(const Light& even_light);

/// Makes a picture as it would have been in the background's light.
void to_background_light(const Light& light, const cv::Mat3b& bgr, cv::Mat3b& result);
/// Does the same to the means of a picture's blocks, in place.
void to_background_light(const Light& light, cv::Mat3f& means);

/// Follows the light from frame to frame (own): a regression of block means outside the last contact on the
/// background's, iteratively reweighted (Tukey) from the last light. Each term is shrunk by how little of the
/// change it explains (positive-part James-Stein), to none where the blocks do not demand it. A slope takes
/// from one color what it gives to another: where all colors change together, and smoothly over the gel, that
/// is the field, continued across contacts. Keeps the last light where fewer than a tenth of the blocks
/// agree.
class LightTracker {
 public:
  /// `uneven`: also look for a field.
  explicit LightTracker(const cv::Mat3f& background_blocks, bool uneven = false);

  /// `blocks`: block means of the frame; `touched`: 255 where the object touches (may be empty).
  const Light& update(const cv::Mat3f& blocks, const cv::Mat1b& touched);
  /// Returns false where all colors of the last picture changed together and no light says how.
  bool is_followed() const { return is_followed_; }

 private:
  struct Fit {
    Light light;
    int agree = 0;  // blocks
  };

  int weigh(const Light& light, double limit, float alike = 0.0F);
  bool regress(Light& light) const;
  Fit fit(Light light, double widening);
  Light median_gains() const;
  Fit with_field(Fit even, const Light* last);

  cv::Mat3f background_;
  bool may_be_uneven_;
  cv::Mat1b none_;
  cv::Mat1f no_field_;
  cv::Mat3f blocks_;    // of this frame
  cv::Mat1b excluded_;  // of this frame
  cv::Mat1f weights_, shades_;
  Light light_;
  bool is_followed_ = true;
  /// Noise, too, makes few blocks agree: where a search found nothing better, this share of blocks agreed,
  /// and none is made again until clearly fewer do.
  double share_at_vain_search_ = 1.0;
};

}  // namespace gelslam::surface::detail
