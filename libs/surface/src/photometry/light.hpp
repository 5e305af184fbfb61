#pragma once

#include <array>
#include <opencv2/core/mat.hpp>

namespace gelslam::surface::detail {

/// The light of a frame, relative to the light in which the background was taken. Where the gel is bare, the
/// mean gray level of a block in one channel is modeled as
///   c0 b + c1 + c2 b f + c3 f,
/// where b is the gray level of the same block in the background and f the value of `field` there. c0 and c1
/// are a gain and an offset of the whole picture. The field, which all channels share, describes changes of
/// light that differ over the picture: stray light, a shadow, or a lamp that flickers while a rolling shutter
/// exposes row after row.
struct Light {
  using Coefficients = std::array<double, 4>;

  std::array<Coefficients, 3> channels{{{1.0}, {1.0}, {1.0}}};  ///< c0 to c3 of blue, green and red
  cv::Mat1f field;  ///< one value per block, smooth, in gray levels; empty if the light changed evenly

  bool is_even() const { return field.empty(); }  ///< only gain and offset differ
};

/// The exponents of b and f in one term of the model (see Light). The terms are fitted in this order, the
/// more plausible ones first, and a later term is fitted to what the earlier ones do not explain.
struct LightTerm {
  std::size_t background, field;
};
inline constexpr std::array<LightTerm, 4> kLightTerms{{{1, 0}, {0, 0}, {1, 1}, {0, 1}}};

/// Maps each 8-bit value of each channel (B, G, R) to the gray level that the pixel would have had in the
/// background's light. Such a table exists only for an even light, which is the same for all pixels.
using ColorTable = std::array<std::array<float, 256>, 3>;
ColorTable color_table(const Light& even_light);

/// Converts a picture to the background's light: it inverts the model of Light in each pixel.
void to_background_light(const Light& light, const cv::Mat3b& bgr, cv::Mat3b& result);
/// Converts the block means of a picture to the background's light, in place.
void to_background_light(const Light& light, cv::Mat3f& means);

/// Estimates the light of every frame, beginning from the light of the frame before; light.cpp describes the
/// regression. If fewer than a tenth of the blocks agree with any light, the light of the last frame is kept.
class LightTracker {
 public:
  /// `background_blocks`: the background's mean color per block. If `uneven` is set, the field of Light is
  /// estimated, too; otherwise only gains and offsets.
  explicit LightTracker(const cv::Mat3f& background_blocks, bool uneven = false);

  /// Returns the light of a frame. `blocks`: the frame's mean color per block; `touched`: 255 for the blocks
  /// to leave out because the object touched them in the frame before, or empty.
  const Light& update(const cv::Mat3f& blocks, const cv::Mat1b& touched);
  /// Returns false if, in more than 30 % of the last picture, all colors changed together and no light that
  /// the model can describe explains the change. The surface of that picture is then not to be trusted.
  bool is_followed() const { return is_followed_; }

 private:
  struct Fit {
    Light light;
    int agree = 0;  // the number of blocks that agree with the light; 0 if the fit failed
  };

  int weigh(const Light& light, double limit, float alike = 0.0F);
  bool regress(Light& light) const;
  Fit fit(Light light, double widening);
  Light median_gains() const;
  Fit with_field(Fit even, const Light* last);

  cv::Mat3f background_;
  bool may_be_uneven_;
  cv::Mat1b none_;              // an empty contact
  cv::Mat1f no_field_;          // a field that is zero everywhere
  cv::Mat3f blocks_;            // the frame's mean color per block
  cv::Mat1b excluded_;          // 255 for blocks that the fit leaves out
  cv::Mat1f weights_, shades_;  // per block: Tukey's weight, and weight * mean residual of the channels
  Light light_;
  bool is_followed_ = true;
  /// The fraction of blocks that agreed in the last frame in which a search from other initial values found
  /// no better light. That search is expensive, and a contact or noise alone can keep the fraction low, so it
  /// is repeated only when the fraction has become clearly smaller.
  double share_at_vain_search_ = 1.0;
};

}  // namespace gelslam::surface::detail
