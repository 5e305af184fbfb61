// Follows how the light differs from that of the background picture, so that slopes are read in the
// background's light (own).
//
// Model: each color channel of a block of bare gel is gain · background + offset; where light is uneven, both
// change with a smooth field, which is the same for all channels. The coefficients are the least-squares fit
// over blocks that agree, with Tukey weights of kAgreeLevels gray levels (iteratively reweighted), and are
// shrunk towards no change by what leaning gel looks like (kLeaningLevels). A slope brightens some colors and
// darkens others; a change that all colors have in common is light, and the field is made of that, smoothed
// over a pyramid and continued across a contact.
//
// The fit starts from the last frame's light. Where too few blocks agree, it starts again from median gains
// with a wide kernel. A contact that covers most of the gel leaves too little to fit: the last light stays.
// is_followed_ is false where all colors of many blocks changed together and no such light explains it.

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

// The limit in gray levels up to which a block agrees with a light. A block's color differs by less (noise of
// its mean is below 1) unless the gel leans by more than about 1 degree (2.7 levels).
constexpr double kAgreeLevels = 3.0;
// How well a term of the light can be known, in gray levels (root mean square over the gel). Gel leans by
// some hundredths of a degree far around a contact. That looks like light, and averaging over blocks does not
// remove it, so no term is known better.
constexpr double kLeaningLevels = 0.1;
// The least share of a term's variance over the gel: one that differs by less from those before it cannot be
// told from them (noise of the background's blocks is that share of how its brightness varies).
constexpr double kMinOwnShare = 1e-3;
constexpr double kMinShare = 0.1;        // of all blocks, to believe in a light
constexpr double kExplainedShare = 0.6;  // of the blocks not excluded: no need to look for more
// A contact that covers half of the gel must not look like a change of light.
constexpr double kClearlyMore = 1.3;
constexpr double kWidening = 8;  // of the kernel at first, where the light changed suddenly
constexpr int kMaxFits = 3;
// A lamp weaker than this does not tell slopes; a gain larger than its inverse does not come from lamps.
constexpr double kMinGain = 0.25;
// The share of all blocks that must differ from an even light by the brightness of all colors alone, and
// agree with a field. Touches let 0.05 agree more (steep gel is darker), a band of 8 gray levels that enters
// the picture 0.09.
constexpr double kShadedShare = 0.07;
// The share of all blocks from which on light is not followed: more whose colors have brightness in common,
// for the larger part, and agree with no light are not what noise (0.23) or touches (0.20, real ones) leave.
constexpr double kUnfollowedShare = 0.3;
constexpr float kMostlyAlike = 1.25F;  // what differs is half of what colors have in common
// What is around a place weighs as much as this share of a block, for the field there.
constexpr double kRidge = 0.01;
constexpr std::size_t kFinestLevel = 2, kLevels = 6;  // cells of 16 to 128 pixels

/// A channel's light in 32 bits.
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

/// Computes Tukey's weights of a row's blocks for residuals up to a limit in gray levels, and weights times
/// residual brightness. How many are not 0. `alike`: share of the residual that all channels have in common,
/// not counted.
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

/// Returns the values `sums` / `weights`, smoothed, where there are weights; where there are none, as around
/// in the same rows, then as around: level by level of a pyramid, each drawn toward the coarser one, the
/// first toward its rows' means. (A lamp that flickers while a shutter rolls changes rows.)
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

/// Weighted sums over the blocks of background^p field^q, and of the change times these.
struct Moments {
  double powers[3][3] = {}, changes[2][2] = {};
};

/// Adds a row of blocks. `degree` is that of the field.
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

/// Returns the first `terms` coefficients of each channel's change by least squares, shrunk. Cholesky factors
/// make the terms independent: what each explains beyond those before it, in all channels, is compared with
/// what leaning gel looks like.
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

/// Returns how many blocks agree with a light, up to a limit in gray levels.
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

/// Fits the coefficients to the weighted blocks. Returns false where no lamp has such a gain.
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

/// Fits a light again and again while the kernel narrows. It agrees with no block where too few are left. A
/// field begins where colors agree but for their common brightness, and grows by what is left of it.
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

/// Returns a light of gains only: per channel the median ratio over the blocks.
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

/// Returns the even light, or, where that leaves many blocks that all colors together set apart, the same or
/// the last one with a field.
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
  // Light that was not followed looks like contact all over.
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
