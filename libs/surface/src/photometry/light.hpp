#pragma once

#include <array>
#include <opencv2/core/mat.hpp>

namespace gelslam::surface::detail {

/// The difference of the light from that of the background. In each channel, the gray level of untouched gel
/// is the sum of coefficient * background^b * field^f over kLightTerms. The first two terms are a gain and an
/// offset of the whole picture. The other two scale a smooth field over the picture, which has one color:
/// stray light, a shadow, or a lamp that flickers during a rolling shutter.
struct Light {
  using Coefficients = std::array<double, 4>;

  std::array<Coefficients, 3> channels{{{1.0}, {1.0}, {1.0}}};
  cv::Mat1f field;  ///< one value per block, smooth; empty: there is none

  bool is_even() const { return field.empty(); }  ///< only gain and offset differ
};

/// The powers of the background and of the field in one term. The terms are fitted in their order, the more
/// plausible ones first, and a later term is fitted to what the earlier ones do not explain.
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

/// Estimates the light of every frame. This is not in the papers. The mean colors of the blocks outside the
/// last contact are regressed on those of the background by iteratively reweighted least squares (Tukey's
/// weights), beginning from the light of the last frame. Each term is shrunk by the positive-part James-Stein
/// factor, so a term that explains no more than noise is zero. The field is found where all colors change
/// together and smoothly over the gel, because a slope makes one color brighter and another darker; it is
/// interpolated across contacts. If fewer than a tenth of the blocks agree with the result, the light of the
/// last frame is kept.
class LightTracker {
 public:
  /// `uneven`: the field is estimated, too.
  explicit LightTracker(const cv::Mat3f& background_blocks, bool uneven = false);

  /// `blocks`: block means of the frame; `touched`: 255 where the object touches (may be empty).
  const Light& update(const cv::Mat3f& blocks, const cv::Mat1b& touched);
  /// Returns false if all colors of the last picture changed together and no estimated light explains it.
  bool is_followed() const { return is_followed_; }

 private:
  struct Fit {
    Light light;
    int agree = 0;  // number of blocks that agree with it
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
  /// The share of the blocks that agreed when a search from other starts found nothing better. Because noise
  /// alone can make few blocks agree, the search is repeated only when clearly fewer of them do.
  double share_at_vain_search_ = 1.0;
};

}  // namespace gelslam::surface::detail
