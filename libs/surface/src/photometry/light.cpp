// Estimates the light of a frame relative to that of the background, so that the gradient model can be given
// colors as they would be in the background's light. This step is not in the papers.
//
// Input: the mean colors of 4x4-pixel blocks in the frame and in the background. The model is that of Light:
// in each channel, bare gel has the level gain * background + offset, and gain and offset may vary linearly
// with a smooth field that all channels share. The coefficients are found by iteratively reweighted least
// squares with Tukey's biweight, whose limit is kAgreeLevels gray levels. In each channel the terms are
// orthogonalized by a Cholesky factorization and shrunk by the positive-part James-Stein factor
// 1 - s^2 / |c|^2, where s is kLeaningLevels: a term that explains no more than a slightly tilted gel would
// is set to zero.
//
// Slope and light are distinguished by color: colored lamps shine from several sides, so a slope brightens
// some colors and darkens others. The field is therefore the part of the residual that all channels share,
// smoothed over an image pyramid, which also interpolates it across contacts.
//
// The fit starts from the light of the last frame. If few blocks agree, it also starts from the median ratios
// of the colors with a wide kernel. Where a contact leaves too little bare gel, the last light is kept.

#include "photometry/light.hpp"

#include <algorithm>
#include <cmath>
#include <opencv2/imgproc.hpp>
#include <utility>

#include "gelslam/core/median.hpp"
#include "gelslam/core/target_clones.hpp"
#include "photometry/blocks.hpp"

namespace gelslam::surface::detail {
namespace {

// A block agrees with a light if its color is within this many gray levels of the model. The noise of a
// block's mean is below 1 level; bare gel exceeds the limit where it is tilted by more than about 1 degree.
constexpr double kAgreeLevels = 3.0;
// The standard deviation of a term of the light, in gray levels (root mean square over the gel). Gel is
// tilted by some hundredths of a degree even far from a contact. This looks like a change of light and does
// not average out over blocks, so no term can be known better.
constexpr double kLeaningLevels = 0.1;
// A term is fitted only if at least this fraction of its mean square over the gel is independent of the terms
// before it. (The noise of the background's block means is this fraction of the variance of its brightness.)
constexpr double kMinOwnShare = 1e-3;
// The smallest fraction of all blocks that has to agree with a light for it to be accepted.
constexpr double kMinShare = 0.1;
// If this fraction of the blocks that are not excluded agrees, no other initial values are tried.
constexpr double kExplainedShare = 0.6;
// A light found from other initial values is preferred only if this many times more blocks agree with it.
// Otherwise a contact that covers half of the gel could be taken for a change of light.
constexpr double kClearlyMore = 1.3;
// The factor by which the kernel's limit is larger at first, when the light may have changed suddenly.
constexpr double kWidening = 8;
constexpr int kMaxFits = 3;
// The limits of a plausible gain are this number and its inverse. With a darker lamp slopes could not be
// read, and no lamp becomes brighter by more.
constexpr double kMinGain = 0.25;
// A field is used only if, compared with the even light, at least this fraction of all blocks agrees in
// addition. Because steep gel is darker, a contact makes up to 0.05 agree in addition; a band 8 gray levels
// brighter that enters the picture makes 0.09 agree.
constexpr double kShadedShare = 0.07;
// The light counts as not followed if more than this fraction of all blocks agrees with no light although
// mainly the brightness common to all colors has changed there. Noise leaves up to 0.23, real contacts 0.20.
constexpr double kUnfollowedShare = 0.3;
// The value of `alike` in weigh() for which a block agrees if the part of its residual in which the channels
// differ is at most half of the part that they have in common.
constexpr float kMostlyAlike = 1.25F;
// At each level of the pyramid, the field of the next coarser level has the weight of this many blocks.
constexpr double kRidge = 0.01;
// The field is estimated on the pyramid's levels from kFinestLevel to kLevels - 1: cells of 16 to 128 pixels.
constexpr std::size_t kFinestLevel = 2, kLevels = 6;

/// The coefficients of one channel in single precision.
struct ChannelLight {
  float gain, offset, shaded_gain, shaded_offset;

  explicit ChannelLight(const Light::Coefficients& k)
      : gain(static_cast<float>(k[0])),
        offset(static_cast<float>(k[1])),
        shaded_gain(static_cast<float>(k[2])),
        shaded_offset(static_cast<float>(k[3])) {}
  float gain_at(float field) const { return gain + field * shaded_gain; }
  float offset_at(float field) const { return offset + field * shaded_offset; }
};
using ChannelLights = std::array<ChannelLight, 3>;

ChannelLights channel_lights(const Light& light) {
  return {ChannelLight(light.channels[0]), ChannelLight(light.channels[1]), ChannelLight(light.channels[2])};
}

template <typename Pixel>
void convert(const Light& light, const cv::Mat_<Pixel>& from, cv::Mat_<Pixel>& to) {
  constexpr auto least_gain = static_cast<float>(kMinGain / 2);
  const ChannelLights lights = channel_lights(light);
  cv::Mat1f field = light.field;
  if (from.size() != field.size()) cv::resize(light.field, field, light.field.size() * kBlockPx);
  to.create(from.size());
  for (int v = 0; v < from.rows; ++v)
    for (int u = 0; u < from.cols; ++u)
      for (int c = 0; c < 3; ++c) {
        const ChannelLight& k = lights[static_cast<std::size_t>(c)];
        to(v, u)[c] = cv::saturate_cast<typename Pixel::value_type>(
            (static_cast<float>(from(v, u)[c]) - k.offset_at(field(v, u))) /
            std::max(least_gain, k.gain_at(field(v, u))));
      }
}

/// Computes for each block of a row Tukey's weight (1 - |r|^2 / limit^2)^2 of its residual r, and (as
/// `shades`) that weight times the mean of r over the channels. Returns how many weights are not 0. `alike`
/// times the squared part of r that all channels have in common is subtracted from |r|^2: with 0 the whole
/// residual counts, with 1 only the differences between the channels.
GELSLAM_CLONES int weigh_row(const cv::Vec3f* now, const cv::Vec3f* background, const unsigned char* excluded,
                             const float* field, std::size_t count, const ChannelLights& light, float limit,
                             float alike, float* weights, float* shades) {
  const float scale = 1.0F / (limit * limit);
  int agree = 0;
  for (std::size_t i = 0; i < count; ++i) {
    float sum = 0.0F, squared = 0.0F;
    for (std::size_t c = 0; c < 3; ++c) {
      const float residual =
          now[i].val[c] - (light[c].gain_at(field[i]) * background[i].val[c] + light[c].offset_at(field[i]));
      sum += residual;
      squared += residual * residual;
    }
    const float brightness = sum * (1.0F / 3);
    squared -= alike * sum * brightness;
    const float closeness = excluded[i] == 0 ? std::max(0.0F, 1.0F - scale * squared) : 0.0F;
    weights[i] = closeness * closeness;
    shades[i] = weights[i] * brightness;
    agree += closeness > 0.0F ? 1 : 0;
  }
  return agree;
}

/// Returns a smooth map of the weighted means `sums` / `weights`. The mean of each row is removed first and
/// added again at the end, because a lamp that flickers during a rolling shutter changes whole rows. The rest
/// is averaged on each level of a pyramid, from coarse to fine. Each level is drawn toward the coarser one,
/// so that blocks without weight are interpolated from their surroundings.
cv::Mat1f smooth_field(const cv::Mat1f& sums, const cv::Mat1f& weights) {
  cv::Mat rows, row_weights;
  cv::reduce(sums, rows, 1, cv::REDUCE_SUM);
  cv::reduce(weights, row_weights, 1, cv::REDUCE_SUM);
  cv::divide(rows, row_weights + 1, rows);
  const cv::Mat by_row = cv::repeat(rows, 1, sums.cols);
  std::array<cv::Mat, kLevels> sum, weight;
  sum[0] = sums - weights.mul(by_row);
  weight[0] = weights;
  for (std::size_t level = 1; level < kLevels; ++level) {
    cv::pyrDown(sum[level - 1], sum[level]);
    cv::pyrDown(weight[level - 1], weight[level]);
  }
  cv::Mat field(sum.back().size(), CV_32F, cv::Scalar(0));
  for (std::size_t level = kLevels; level-- > 0;) {
    if (level + 1 < kLevels) cv::pyrUp(field, field, sum[level].size());
    if (level >= kFinestLevel) cv::divide(sum[level] + kRidge * field, weight[level] + kRidge, field);
  }
  field += by_row;
  return field;
}

/// The normal equations of one channel. With the background's level b, the field f and the change d since the
/// background, powers[p][q] is the weighted sum of b^p f^q over the blocks, and changes[p][q] that of
/// d b^p f^q.
struct Moments {
  double powers[3][3] = {}, changes[2][2] = {};
};

/// Adds a row of blocks to the moments. `degree` is the largest exponent of the field in the model: 0 for an
/// even light, 1 with a field.
template <std::size_t degree>
void add_row_moments(const cv::Vec3f* now, const cv::Vec3f* background, const float* weights,
                     const float* field, std::size_t count, int channel, Moments& moments) {
  for (std::size_t u = 0; u < count; ++u) {
    if (weights[u] == 0.0F) continue;
    const double then = background[u][channel];
    double term = weights[u], change = term * (now[u][channel] - then);
    for (std::size_t q = 0; q <= 2 * degree; ++q, term *= field[u], change *= field[u]) {
      moments.powers[0][q] += term;
      moments.powers[1][q] += term * then;
      moments.powers[2][q] += term * then * then;
      if (q > degree) continue;
      moments.changes[0][q] += change;
      moments.changes[1][q] += change * then;
    }
  }
}

/// Solves the normal equations of each channel for the first `terms` coefficients and shrinks them. The
/// Cholesky factorization makes the terms orthogonal. For each term, the squared change (in gray levels,
/// summed over the channels) that it explains beyond the terms before it is compared with the variance
/// kLeaningLevels^2 per channel, which gives the James-Stein factor. The coefficients are those of the change
/// since the background, so that all of them are zero for an unchanged light.
std::array<Light::Coefficients, 3> shrunk_solution(const std::array<Moments, 3>& moments, std::size_t terms) {
  using Square = std::array<Light::Coefficients, kLightTerms.size()>;
  std::array<Square, 3> factors{};
  std::array<Light::Coefficients, 3> solutions{};
  Light::Coefficients shrinkage{};
  for (std::size_t i = 0; i < terms; ++i) {
    const LightTerm& a = kLightTerms[i];
    double squared_levels = 0.0;
    for (std::size_t c = 0; c < 3; ++c) {
      const double total = moments[c].powers[0][0];
      Square& factor = factors[c];
      double levels = moments[c].changes[a.background][a.field] / total;
      for (std::size_t j = 0; j <= i; ++j) {
        const LightTerm& b = kLightTerms[j];
        const double whole = moments[c].powers[a.background + b.background][a.field + b.field] / total;
        double own = whole;
        for (std::size_t k = 0; k < j; ++k) own -= factor[i][k] * factor[j][k];
        if (j == i) {
          factor[i][i] = own > kMinOwnShare * whole ? std::sqrt(own) : 0.0;
        } else if (factor[j][j] > 0.0) {
          factor[i][j] = own / factor[j][j];
          levels -= factor[i][j] * solutions[c][j];
        }
      }
      if (factor[i][i] > 0.0) solutions[c][i] = levels / factor[i][i];
      squared_levels += solutions[c][i] * solutions[c][i];
    }
    constexpr double leaning = 3 * kLeaningLevels * kLeaningLevels;
    shrinkage[i] = squared_levels > leaning ? 1.0 - leaning / squared_levels : 0.0;
  }
  for (std::size_t c = 0; c < 3; ++c) {
    for (std::size_t i = terms; i-- > 0;) {
      double& value = solutions[c][i];
      value *= shrinkage[i];
      for (std::size_t k = i + 1; k < terms; ++k) value -= factors[c][k][i] * solutions[c][k];
      value = factors[c][i][i] > 0.0 ? value / factors[c][i][i] : 0.0;
    }
  }
  return solutions;
}

}  // namespace

ColorTable color_table(const Light& even_light) {
  ColorTable table;
  for (std::size_t c = 0; c < 3; ++c) {
    const Light::Coefficients& k = even_light.channels[c];
    for (std::size_t value = 0; value < 256; ++value)
      table[c][value] = static_cast<float>((static_cast<double>(value) - k[1]) / k[0]);
  }
  return table;
}

void to_background_light(const Light& light, const cv::Mat3b& bgr, cv::Mat3b& result) {
  convert(light, bgr, result);
}

void to_background_light(const Light& light, cv::Mat3f& means) {
  if (!light.is_even()) return convert(light, means, means);
  for (cv::Vec3f& mean : means) {
    for (std::size_t c = 0; c < 3; ++c) {
      float& value = mean[static_cast<int>(c)];
      value = static_cast<float>((static_cast<double>(value) - light.channels[c][1]) / light.channels[c][0]);
    }
  }
}

LightTracker::LightTracker(const cv::Mat3f& background_blocks, bool uneven)
    : background_(background_blocks.clone()),
      may_be_uneven_(uneven),
      none_(background_blocks.size(), static_cast<unsigned char>(0)),
      no_field_(background_blocks.size(), 0.0F),
      weights_(background_blocks.size()),
      shades_(background_blocks.size()) {}

/// Computes weights_ and shades_ for a light, and returns how many blocks agree with it to within `limit`
/// gray levels. See weigh_row for `alike`.
int LightTracker::weigh(const Light& light, double limit, float alike) {
  int agree = 0;
  const ChannelLights lights = channel_lights(light);
  const cv::Mat1f& field = light.is_even() ? no_field_ : light.field;
  for (int row = 0; row < blocks_.rows; ++row)
    agree += weigh_row(blocks_[row], background_[row], excluded_[row], field[row],
                       static_cast<std::size_t>(blocks_.cols), lights, static_cast<float>(limit), alike,
                       weights_[row], shades_[row]);
  return agree;
}

/// Fits the coefficients to the blocks with weights_. Returns false if a gain is implausible (kMinGain).
bool LightTracker::regress(Light& light) const {
  std::array<Moments, 3> moments;
  const cv::Mat1f& field = light.is_even() ? no_field_ : light.field;
  for (int row = 0; row < blocks_.rows; ++row)
    for (int c = 0; c < 3; ++c)
      (light.is_even() ? add_row_moments<0> : add_row_moments<1>)(blocks_[row], background_[row],
                                                                  weights_[row], field[row],
                                                                  static_cast<std::size_t>(blocks_.cols), c,
                                                                  moments[static_cast<std::size_t>(c)]);
  light.channels = shrunk_solution(moments, light.is_even() ? 2 : kLightTerms.size());
  return std::all_of(light.channels.begin(), light.channels.end(), [](Light::Coefficients& channel) {
    channel[0] += 1.0;
    return channel[0] > kMinGain && channel[0] < 1 / kMinGain;
  });
}

/// Fits a light by iteratively reweighted least squares, whose kernel is at first `widening` times as wide
/// and is halved in each iteration. The result has agree = 0 if too few blocks agree. If `light` has a field,
/// the first iteration ignores the common brightness of the channels in its residuals; each iteration adds to
/// the field what is left of that brightness.
LightTracker::Fit LightTracker::fit(Light light, double widening) {
  const int enough = static_cast<int>(kMinShare * static_cast<double>(blocks_.total()));
  const bool is_even = light.is_even();
  int before = 0;
  for (int fits = 0;; widening = std::max(1.0, widening / 2)) {
    const int agree = weigh(light, widening * kAgreeLevels, !is_even && before == 0 ? 1.0F : 0.0F);
    if (agree < enough) return {};
    if (widening == 1.0) {
      if (fits++ == kMaxFits || agree == before) return {light, agree};
    }
    before = agree;
    if (!is_even) light.field += smooth_field(shades_, weights_);
    if (!regress(light)) return {};
  }
}

/// Returns a light without offsets, whose gains are the median ratios of frame to background over the blocks.
Light LightTracker::median_gains() const {
  Light light;
  std::vector<float> ratios;
  ratios.reserve(blocks_.total());
  for (std::size_t c = 0; c < 3; ++c) {
    const int channel = static_cast<int>(c);
    ratios.clear();
    for (int row = 0; row < blocks_.rows; ++row) {
      for (int column = 0; column < blocks_.cols; ++column) {
        if (excluded_(row, column) != 0) continue;
        ratios.push_back(blocks_(row, column)[channel] / std::max(background_(row, column)[channel], 1.0F));
      }
    }
    if (ratios.empty()) return {};
    light.channels[c][0] =
        std::clamp(static_cast<double>(quantile_in_place(ratios, 0.5)), kMinGain, 1 / kMinGain);
  }
  return light;
}

/// Returns `even`, or a light with a field if many blocks differ from `even` only by a brightness that all
/// channels share and the field makes them agree. The fit of the field starts from `even` or from `last`
/// (may be null), whichever agrees with more blocks when that brightness is ignored.
LightTracker::Fit LightTracker::with_field(Fit even, const Light* last) {
  if (!may_be_uneven_ || even.agree == 0) return even;
  const int more = even.agree + static_cast<int>(kShadedShare * static_cast<double>(blocks_.total()));
  const int alike = weigh(even.light, kAgreeLevels, 1.0F),
            alike_last = last == nullptr ? 0 : weigh(*last, kAgreeLevels, 1.0F);
  if (std::max(alike, alike_last) < more) return even;
  Light start = alike > alike_last ? even.light : *last;
  start.field = no_field_.clone();
  Fit uneven = fit(std::move(start), 1.0);
  return uneven.agree > more ? uneven : even;
}

const Light& LightTracker::update(const cv::Mat3f& blocks, const cv::Mat1b& touched) {
  const int total = static_cast<int>(blocks.total());
  int bare = touched.empty() ? total : total - cv::countNonZero(touched);
  // After a change of light that was not followed, nearly all blocks may have been taken for contact. Then
  // the contact must not be excluded, or the light could never be found again.
  const bool is_believable = bare >= kMinShare * total;
  if (!is_believable) bare = total;
  blocks_ = blocks;
  excluded_ = is_believable && !touched.empty() ? touched : none_;
  Light even;
  for (std::size_t c = 0; c < 3; ++c) even.channels[c] = {light_.channels[c][0], light_.channels[c][1]};
  if (even.channels != Light{}.channels && weigh(even, kAgreeLevels) < weigh(Light{}, kAgreeLevels))
    even = Light{};
  Fit best = fit(even, 1.0);
  const double share = static_cast<double>(best.agree) / bare;
  if (share >= kExplainedShare) {
    share_at_vain_search_ = 1.0;
  } else if (best.agree == 0 || share * kClearlyMore < share_at_vain_search_) {
    Fit jumped = fit(median_gains(), kWidening);
    const bool is_better = jumped.agree > kClearlyMore * best.agree;
    if (is_better) best = std::move(jumped);
    share_at_vain_search_ = is_better ? 1.0 : share;
  }
  best = with_field(std::move(best), share < kExplainedShare ? &even : nullptr);
  is_followed_ = share >= kExplainedShare ||
                 weigh(best.light, kAgreeLevels, kMostlyAlike) < best.agree + kUnfollowedShare * total;
  if (best.agree > 0) light_ = std::move(best.light);
  return light_;
}

}  // namespace gelslam::surface::detail
