#include "photometry/light.hpp"

#include <algorithm>
#include <cmath>
#include <opencv2/core.hpp>
#include <span>
#include <utility>

#include "gelslam/core/median.hpp"
#include "gelslam/core/target_clones.hpp"

namespace gelslam::surface::detail {
namespace {

// Gray levels. A block's color differs by less (noise of its mean is below 1) unless the gel leans by more
// than about 1 degree (2.7 levels).
constexpr double kAgreeLevels = 3.0;
// Gray levels (root mean square over the gel). Gel leans by some hundredths of a degree far around a contact.
// That looks like light, and averaging over blocks does not remove it, so no term is known better.
constexpr double kLeaningLevels = 0.1;
// Of a term's variance over the gel: one that differs by less from those before it cannot be told from them
// (noise of the background's blocks is that share of how its brightness varies).
constexpr double kMinOwnShare = 1e-3;    // numerics
constexpr double kMinShare = 0.1;        // of all blocks, to believe in a light; of an uneven one twice that
constexpr double kExplainedShare = 0.6;  // of the blocks not excluded: no need to look for more
// A contact that covers half of the gel must not look like a change of light.
constexpr double kClearlyMore = 1.3;
constexpr double kWidening = 8;  // numerics: of the kernel at first where the light changed suddenly
constexpr int kMaxFits = 3;      // numerics
// A lamp weaker than this does not tell slopes; a gain larger than its inverse does not come from lamps.
constexpr double kMinGain = 0.25;

/// From -1 to 1 over the picture.
double unit_place(int index, int count) { return count < 2 ? 0.0 : 2.0 * index / (count - 1) - 1.0; }

using LightOrder = std::span<const std::size_t>;  // indices of kLightTerms, most plausible first
constexpr std::size_t kEven[] = {0, 1}, kLampOrder[] = {0, 2, 3, 1}, kStrayOrder[] = {1, 4, 5, 0};

/// A channel's light within a row: polynomials in x.
struct RowLight {
  float gain[2] = {}, offset[2] = {};

  RowLight(const Light::Coefficients& k, double y) {
    for (std::size_t i = 0; i < k.size(); ++i) {
      const LightTerm& term = kLightTerms[i];
      (term.background == 1 ? gain : offset)[term.x] += static_cast<float>(term.y == 0 ? k[i] : k[i] * y);
    }
  }
  float gain_at(float x) const { return gain[0] + x * gain[1]; }
  float offset_at(float x) const { return offset[0] + x * offset[1]; }
};
using RowLights = std::array<RowLight, 3>;

RowLights row_lights(const Light& light, double y) {
  return {RowLight(light.channels[0], y), RowLight(light.channels[1], y), RowLight(light.channels[2], y)};
}

double row_gain_at(const std::vector<double>& rows, double y) {
  if (rows.empty()) return 1.0;
  const double place = (y + 1.0) / 2.0 * static_cast<double>(rows.size() - 1);
  const auto above = std::min(static_cast<std::size_t>(place), rows.size() - 1),
             below = std::min(above + 1, rows.size() - 1);
  return std::lerp(rows[above], rows[below], place - static_cast<double>(above));
}

template <typename Pixel>
void convert(const Light& light, const cv::Mat_<Pixel>& from, cv::Mat_<Pixel>& to) {
  constexpr auto least_gain = static_cast<float>(kMinGain / 2);
  to.create(from.size());
  for (int v = 0; v < from.rows; ++v) {
    const double y = unit_place(v, from.rows);
    const auto row_gain = static_cast<float>(row_gain_at(light.row_gain, y));
    const RowLights row = row_lights(light, y);
    for (int u = 0; u < from.cols; ++u) {
      const auto x = static_cast<float>(unit_place(u, from.cols));
      for (int c = 0; c < 3; ++c) {
        const RowLight& k = row[static_cast<std::size_t>(c)];
        to(v, u)[c] = cv::saturate_cast<typename Pixel::value_type>(
            (static_cast<float>(from(v, u)[c]) / row_gain - k.offset_at(x)) /
            std::max(least_gain, k.gain_at(x)));
      }
    }
  }
}

/// Tukey's weights of a row's blocks for residuals up to a limit in gray levels. How many are not 0.
GELSLAM_CLONES int weigh_row(const cv::Vec3f* now, const cv::Vec3f* background, const unsigned char* excluded,
                             const float* x, std::size_t count, const RowLights& light, float row_gain,
                             float limit, float* weights) {
  const float scale = 1.0F / (limit * limit);
  int agree = 0;
  for (std::size_t i = 0; i < count; ++i) {
    float squared = 0.0F;
    for (std::size_t c = 0; c < 3; ++c) {
      const float residual = now[i].val[c] - row_gain * (light[c].gain_at(x[i]) * background[i].val[c] +
                                                         light[c].offset_at(x[i]));
      squared += residual * residual;
    }
    const float closeness = excluded[i] == 0 ? std::max(0.0F, 1.0F - scale * squared) : 0.0F;
    weights[i] = closeness * closeness;
    agree += closeness > 0.0F ? 1 : 0;
  }
  return agree;
}

/// Weighted sums over the blocks of background^p x^i y^j, and of the change times these.
struct Moments {
  double powers[3][3][3] = {}, changes[2][2][2] = {};
};

/// Adds a row of blocks. `degree`: of the field.
template <std::size_t degree>
void add_row_moments(const cv::Vec3f* now, const cv::Vec3f* background, const float* weights, const float* x,
                     std::size_t count, int channel, double inverse_row_gain, double y, Moments& moments) {
  double powers[3][2 * degree + 1] = {}, changes[2][degree + 1] = {};
  for (std::size_t u = 0; u < count; ++u) {
    if (weights[u] == 0.0F) continue;
    const double then = background[u][channel];
    double term = weights[u], change = term * (now[u][channel] * inverse_row_gain - then);
    for (std::size_t i = 0; i <= 2 * degree; ++i, term *= x[u], change *= x[u]) {
      powers[0][i] += term;
      powers[1][i] += term * then;
      powers[2][i] += term * then * then;
      if (i > degree) continue;
      changes[0][i] += change;
      changes[1][i] += change * then;
    }
  }
  double scale = 1.0;
  for (std::size_t j = 0; j <= 2 * degree; ++j, scale *= y)
    for (std::size_t i = 0; i <= 2 * degree; ++i) {
      for (std::size_t p = 0; p < 3; ++p) moments.powers[p][i][j] += scale * powers[p][i];
      if (i <= degree && j <= degree)
        for (std::size_t p = 0; p < 2; ++p) moments.changes[p][i][j] += scale * changes[p][i];
    }
}

/// Coefficients of each channel's change by least squares, shrunk. Cholesky factors make the terms
/// independent: what each explains beyond those before it, in all channels, is compared with what leaning gel
/// looks like.
std::array<Light::Coefficients, 3> shrunk_solution(const std::array<Moments, 3>& moments, LightOrder order) {
  using Square = std::array<Light::Coefficients, kLightTerms.size()>;
  std::array<Square, 3> factors{};
  std::array<Light::Coefficients, 3> solutions{}, result{};
  Light::Coefficients shrinkage{};
  for (std::size_t i = 0; i < order.size(); ++i) {
    const LightTerm& a = kLightTerms[order[i]];
    double squared_levels = 0.0;
    for (std::size_t c = 0; c < 3; ++c) {
      const double total = moments[c].powers[0][0][0];
      Square& factor = factors[c];
      double levels = moments[c].changes[a.background][a.x][a.y] / total;
      for (std::size_t j = 0; j <= i; ++j) {
        const LightTerm& b = kLightTerms[order[j]];
        const double whole = moments[c].powers[a.background + b.background][a.x + b.x][a.y + b.y] / total;
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
    for (std::size_t i = order.size(); i-- > 0;) {
      double& value = solutions[c][i];
      value *= shrinkage[i];
      for (std::size_t k = i + 1; k < order.size(); ++k) value -= factors[c][k][i] * solutions[c][k];
      value = factors[c][i][i] > 0.0 ? value / factors[c][i][i] : 0.0;
      result[c][order[i]] = value;
    }
  }
  return result;
}

}  // namespace

bool Light::is_even() const {
  return row_gain.empty() && std::all_of(channels.begin(), channels.end(), [](const Coefficients& k) {
           return std::all_of(k.begin() + 2, k.end(), [](double field) { return field == 0.0; });
         });
}

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
      weights_(background_blocks.size()) {
  for (int column = 0; column < background_.cols; ++column)
    x_.push_back(static_cast<float>(unit_place(column, background_.cols)));
}

/// How many blocks agree with a light, up to a limit in gray levels.
int LightTracker::weigh(const Light& light, double limit) {
  int agree = 0;
  const bool rows_alike = light.is_even();
  RowLights lights = row_lights(light, 0.0);
  for (int row = 0; row < blocks_.rows; ++row) {
    const double row_gain = light.row_gain.empty() ? 1.0 : light.row_gain[static_cast<std::size_t>(row)];
    if (!rows_alike) lights = row_lights(light, unit_place(row, blocks_.rows));
    agree += weigh_row(blocks_[row], background_[row], excluded_[row], x_.data(), x_.size(), lights,
                       static_cast<float>(row_gain), static_cast<float>(limit), weights_[row]);
  }
  return agree;
}

/// Fits the coefficients to the weighted blocks. False where no lamp has such a gain.
bool LightTracker::regress(Light& light, std::span<const std::size_t> order) const {
  std::array<Moments, 3> moments;
  for (int row = 0; row < blocks_.rows; ++row) {
    const double inverse = light.row_gain.empty() ? 1.0 : 1 / light.row_gain[static_cast<std::size_t>(row)];
    for (int c = 0; c < 3; ++c)
      (order.size() == 2 ? add_row_moments<0> : add_row_moments<1>)(blocks_[row], background_[row],
                                                                    weights_[row], x_.data(), x_.size(), c,
                                                                    inverse, unit_place(row, blocks_.rows),
                                                                    moments[static_cast<std::size_t>(c)]);
  }
  light.channels = shrunk_solution(moments, order);
  return std::all_of(light.channels.begin(), light.channels.end(), [](Light::Coefficients& channel) {
    channel[0] += 1.0;
    return channel[0] > kMinGain && channel[0] < 1 / kMinGain;
  });
}

/// Fitted again and again while the kernel narrows. Agrees with no block where too few are left.
LightTracker::Fit LightTracker::fit(Light light, std::span<const std::size_t> order, double widening) {
  const double least_share = order.size() == 2 && light.row_gain.empty() ? kMinShare : 2 * kMinShare;
  const int enough = static_cast<int>(least_share * static_cast<double>(blocks_.total()));
  const bool has_rows = !light.row_gain.empty();
  int before = 0;
  for (int fits = 0;; widening = std::max(1.0, widening / 2)) {
    const int agree = weigh(light, widening * kAgreeLevels);
    if (agree < enough) return {};
    if (widening == 1.0) {
      if (fits++ == kMaxFits || agree == before) return {light, agree};
      before = agree;
    }
    if (!regress(light, order)) return {};
    if (has_rows) light.row_gain = median_rows(light);
  }
}

/// Gains only: per channel the median ratio over the blocks.
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

/// The median ratio over each row, of an even light. The sum of the colors counts: a slope takes from one
/// what it gives to another. Covered rows are as the one above them.
std::vector<double> LightTracker::median_rows(const Light& light) const {
  std::vector<double> gains, ratios;
  for (int row = 0; row < blocks_.rows; ++row) {
    ratios.clear();
    for (int column = 0; column < blocks_.cols; ++column) {
      if (excluded_(row, column) != 0) continue;
      double seen = 0.0, expected = 0.0;
      for (std::size_t c = 0; c < 3; ++c) {
        seen += blocks_(row, column)[static_cast<int>(c)];
        expected +=
            light.channels[c][0] * background_(row, column)[static_cast<int>(c)] + light.channels[c][1];
      }
      ratios.push_back(seen / std::max(expected, 1.0));
    }
    const double above = gains.empty() ? 1.0 : gains.back();
    const bool is_seen = static_cast<double>(ratios.size()) >= kMinShare * blocks_.cols;
    gains.push_back(is_seen ? std::clamp(quantile_in_place(ratios, 0.5), kMinGain, 1 / kMinGain) : above);
  }
  return gains;
}

/// Light that jumped or is uneven, where the even light followed so far explains little.
LightTracker::Fit LightTracker::search(const Fit& followed) {
  const Light scaled = median_gains();
  Fit best = followed;
  Fit jumped = fit(scaled, kEven, kWidening);
  if (jumped.agree > kClearlyMore * best.agree) best = std::move(jumped);
  if (!may_be_uneven_) return best;
  Light rows = scaled, last = light_;
  rows.row_gain = median_rows(scaled);
  last.row_gain.clear();
  Fit uneven = fit(rows, kEven, kWidening);
  for (const auto& [start, widening] : {std::pair(last, 1.0), std::pair(scaled, kWidening)})
    for (const LightOrder order : {LightOrder(kLampOrder), LightOrder(kStrayOrder)}) {
      Fit field = fit(start, order, widening);
      if (field.agree > uneven.agree) uneven = std::move(field);
    }
  return uneven.agree > (light_.is_even() ? kClearlyMore : 1.0) * best.agree ? uneven : best;
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
  Fit best = fit(even, kEven, 1.0);
  const double share = static_cast<double>(best.agree) / bare;
  if (share >= kExplainedShare) {
    share_at_vain_search_ = 1.0;
  } else if (best.agree == 0 || share * kClearlyMore < share_at_vain_search_) {
    const int followed = best.agree;
    best = search(best);
    share_at_vain_search_ = best.agree > followed ? 1.0 : share;
  }
  if (best.agree > 0) light_ = std::move(best.light);
  return light_;
}

}  // namespace gelslam::surface::detail
