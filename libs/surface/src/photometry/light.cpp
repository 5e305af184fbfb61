#include "photometry/light.hpp"

#include <algorithm>
#include <cmath>
#include <opencv2/core.hpp>
#include <utility>

#include "gelslam/core/median.hpp"
#include "gelslam/core/target_clones.hpp"

namespace gelslam::surface::detail {
namespace {

// Noise of a block mean is below 1; a slope of 1 degree changes the color by 2.7.
constexpr double kGateLevels = 2.5;
constexpr int kGateHalvings =
    3;  // where the light changed suddenly, the gate is this much wider and closes on it
constexpr double kLeastShare = 0.1;  // of all blocks, to believe in a light; twice as many in an uneven one
constexpr double kExplainedShare = 0.6;  // of the blocks not excluded: no need to look for more
constexpr int kConvergedIn = 100;  // a fit after which fewer than one in 100 agreeing blocks change is done
// A contact that covers half of the gel must not look like a change of light.
constexpr double kClearlyMore = 1.3;
// Variance of the background's brightness below which gain and offset cannot be told apart, and the gain
// stays as expected. A field does what a gain over a smooth background does, too.
constexpr double kGainPriorVariance = 50.0;
constexpr double kFieldPriorShare = 0.002;  // keeps the field 0 where too little is seen
// A lamp weaker than this does not tell slopes; a gain larger than its inverse does not come from lamps.
constexpr double kLeastGain = 0.25;

/// From -1 to 1 over the picture.
double unit_place(int index, int count) { return count < 2 ? 0.0 : 2.0 * index / (count - 1) - 1.0; }

/// By what a channel's coefficients are multiplied.
Light::Coefficients terms_at(double background, double x, double y, bool field_multiplies) {
  const double scale = field_multiplies ? background / 128.0 : 1.0;
  return {background, 1.0, scale * x, scale * y, scale * x * x, scale * x * y, scale * y * y};
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
  to.create(from.size());
  for (int v = 0; v < from.rows; ++v) {
    const double y = unit_place(v, from.rows), row_gain = row_gain_at(light.row_gain, y);
    for (int u = 0; u < from.cols; ++u) {
      const double x = unit_place(u, from.cols);
      for (int c = 0; c < 3; ++c) {
        const Light::Coefficients& k = light.channels[static_cast<std::size_t>(c)];
        const double field = k[2] * x + k[3] * y + k[4] * x * x + k[5] * x * y + k[6] * y * y;
        const double gain = light.field_multiplies ? std::max(kLeastGain / 2, k[0] + field / 128.0) : k[0];
        const double offset = light.field_multiplies ? k[1] : k[1] + field;
        to(v, u)[c] =
            cv::saturate_cast<typename Pixel::value_type>((from(v, u)[c] / row_gain - offset) / gain);
      }
    }
  }
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
      inliers_(none_.clone()) {}

namespace {

/// select_inliers() for even light.
GELSLAM_CLONES int select_by_even_light(const cv::Vec3f* now, const cv::Vec3f* background,
                                        const unsigned char* excluded, std::size_t count, const Light& light,
                                        float squared_gate, unsigned char* inliers) {
  float gain[3], offset[3];
  for (std::size_t c = 0; c < 3; ++c) {
    gain[c] = static_cast<float>(light.channels[c][0]);
    offset[c] = static_cast<float>(light.channels[c][1]);
  }
  int found = 0;
  for (std::size_t i = 0; i < count; ++i) {
    float squared_residual = 0.0F;
    for (int c = 0; c < 3; ++c) {
      const float residual = now[i].val[c] - (gain[c] * background[i].val[c] + offset[c]);
      squared_residual += residual * residual;
    }
    const unsigned char agrees = (squared_residual < squared_gate) & (excluded[i] == 0);
    inliers[i] = agrees;
    found += agrees;
  }
  return found;
}

}  // namespace

int LightTracker::select_inliers(const cv::Mat3f& blocks, const cv::Mat1b& excluded, const Light& light,
                                 double gate) {
  const double squared_gate = gate * gate;
  if (light.is_even())
    return select_by_even_light(blocks[0], background_[0], excluded[0], blocks.total(), light,
                                static_cast<float>(squared_gate), inliers_[0]);
  int count = 0;
  for (int row = 0; row < blocks.rows; ++row) {
    const double y = unit_place(row, blocks.rows);
    const double row_gain = light.row_gain.empty() ? 1.0 : light.row_gain[static_cast<std::size_t>(row)];
    for (int column = 0; column < blocks.cols; ++column) {
      const cv::Vec3f &now = blocks(row, column), &background = background_(row, column);
      double squared_residual = 0.0;
      for (std::size_t c = 0; c < 3; ++c) {
        const double then = background[static_cast<int>(c)];
        const Light::Coefficients& k = light.channels[c];
        double expected = k[0] * then + k[1];
        if (light.has_field) {
          const Light::Coefficients term =
              terms_at(then, unit_place(column, blocks.cols), y, light.field_multiplies);
          for (std::size_t i = 2; i < term.size(); ++i) expected += k[i] * term[i];
        }
        const double residual = now[static_cast<int>(c)] - row_gain * expected;
        squared_residual += residual * residual;
      }
      const bool agrees = squared_residual < squared_gate && excluded(row, column) == 0;
      inliers_(row, column) = agrees ? 1 : 0;
      count += agrees ? 1 : 0;
    }
  }
  return count;
}

/// Gain (near that of `expected`) and offset of the inliers. False where no lamp has that gain.
bool LightTracker::fit_even(const cv::Mat3f& blocks, const Light& expected, Light& light) const {
  light = Light{};
  for (std::size_t c = 0; c < 3; ++c) {
    const double expected_gain = expected.channels[c][0];
    const int channel = static_cast<int>(c);
    double count = 0.0, then_sum = 0.0, then_squares = 0.0, changes = 0.0, then_changes = 0.0;
    for (int row = 0; row < blocks.rows; ++row) {
      for (int column = 0; column < blocks.cols; ++column) {
        if (inliers_(row, column) == 0) continue;
        const double then = background_(row, column)[channel];
        const double change = blocks(row, column)[channel] - expected_gain * then;
        count += 1.0;
        then_sum += then;
        then_squares += then * then;
        changes += change;
        then_changes += then * change;
      }
    }
    then_squares += kGainPriorVariance * count;
    const double determinant = then_squares * count - then_sum * then_sum;
    if (!(determinant > 0.0)) return false;
    const double gain = expected_gain + (then_changes * count - then_sum * changes) / determinant;
    if (gain < kLeastGain || gain > 1 / kLeastGain) return false;
    light.channels[c][0] = gain;
    light.channels[c][1] = (then_squares * changes - then_sum * then_changes) / determinant;
  }
  return true;
}

/// All coefficients. Gains are near those of `light`, or near 1 where the field adds (a lamp that changes
/// does not come with stray light). False where no lamp has such a gain.
bool LightTracker::fit_field(const cv::Mat3f& blocks, Light& light) const {
  constexpr int terms = std::tuple_size_v<Light::Coefficients>;
  const auto expected_gain = [&](std::size_t c) {
    return light.field_multiplies ? light.channels[c][0] : 1.0;
  };
  using Square = cv::Matx<double, terms, terms>;
  std::array<Square, 3> squares;
  std::array<cv::Vec<double, terms>, 3> products;
  for (int row = 0; row < blocks.rows; ++row) {
    const double y = unit_place(row, blocks.rows);
    for (int column = 0; column < blocks.cols; ++column) {
      if (inliers_(row, column) == 0) continue;
      const double x = unit_place(column, blocks.cols);
      for (std::size_t c = 0; c < 3; ++c) {
        const double then = background_(row, column)[static_cast<int>(c)];
        const cv::Vec<double, terms> term(terms_at(then, x, y, light.field_multiplies).data());
        squares[c] += term * term.t();
        products[c] += term * (blocks(row, column)[static_cast<int>(c)] - expected_gain(c) * then);
      }
    }
  }
  for (std::size_t c = 0; c < 3; ++c) {
    const double count = squares[c](1, 1);
    squares[c](0, 0) += kGainPriorVariance * count;
    for (int i = 2; i < terms; ++i) squares[c](i, i) += kFieldPriorShare * count;
    cv::Vec<double, terms> solution;
    if (!cv::solve(squares[c], products[c], solution, cv::DECOMP_CHOLESKY)) return false;
    solution[0] += expected_gain(c);
    if (solution[0] < kLeastGain || solution[0] > 1 / kLeastGain) return false;
    std::copy(solution.val, solution.val + terms, light.channels[c].begin());
  }
  light.has_field = true;
  return true;
}

/// Gains only: per channel the median ratio over the blocks.
Light LightTracker::fit_by_median(const cv::Mat3f& blocks, const cv::Mat1b& excluded) const {
  Light light;
  std::vector<float> ratios;
  ratios.reserve(blocks.total());
  for (std::size_t c = 0; c < 3; ++c) {
    const int channel = static_cast<int>(c);
    ratios.clear();
    for (int row = 0; row < blocks.rows; ++row) {
      for (int column = 0; column < blocks.cols; ++column) {
        if (excluded(row, column) != 0) continue;
        ratios.push_back(blocks(row, column)[channel] / std::max(background_(row, column)[channel], 1.0F));
      }
    }
    if (ratios.empty()) return {};
    light.channels[c][0] =
        std::clamp(static_cast<double>(quantile_in_place(ratios, 0.5)), kLeastGain, 1 / kLeastGain);
  }
  return light;
}

/// The median ratio over each row, of an even light. The sum of the colors counts: a slope takes from one
/// what it gives to another. Covered rows are as the one above them.
std::vector<double> LightTracker::fit_rows(const cv::Mat3f& blocks, const cv::Mat1b& excluded,
                                           const Light& light) const {
  std::vector<double> gains, ratios;
  for (int row = 0; row < blocks.rows; ++row) {
    ratios.clear();
    for (int column = 0; column < blocks.cols; ++column) {
      if (excluded(row, column) != 0) continue;
      double seen = 0.0, expected = 0.0;
      for (std::size_t c = 0; c < 3; ++c) {
        seen += blocks(row, column)[static_cast<int>(c)];
        expected +=
            light.channels[c][0] * background_(row, column)[static_cast<int>(c)] + light.channels[c][1];
      }
      ratios.push_back(seen / std::max(expected, 1.0));
    }
    const double above = gains.empty() ? 1.0 : gains.back();
    const bool is_seen = static_cast<double>(ratios.size()) >= kLeastShare * blocks.cols;
    gains.push_back(is_seen ? std::clamp(quantile_in_place(ratios, 0.5), kLeastGain, 1 / kLeastGain) : above);
  }
  return gains;
}

LightTracker::Fit LightTracker::refine_even(const cv::Mat3f& blocks, const cv::Mat1b& excluded,
                                            const Light& expected, Light light) {
  const int enough = static_cast<int>(kLeastShare * static_cast<double>(blocks.total()));
  int agree = select_inliers(blocks, excluded, light, kGateLevels), before = 0;
  for (int iteration = 0; iteration < 3 && kConvergedIn * std::abs(agree - before) > agree; ++iteration) {
    if (agree < enough || !fit_even(blocks, expected, light)) return {};
    before = agree;
    agree = select_inliers(blocks, excluded, light, kGateLevels);
  }
  return {light, agree};
}

/// Fitted again and again while the gate closes.
LightTracker::Fit LightTracker::refine_field(const cv::Mat3f& blocks, const cv::Mat1b& excluded, Light light,
                                             bool multiplies, double gate) {
  const int enough = static_cast<int>(2 * kLeastShare * static_cast<double>(blocks.total()));
  light.row_gain.clear();
  const Light start = light;
  int left_at_last_gate = 3;
  while (left_at_last_gate > 0) {
    if (gate == kGateLevels) --left_at_last_gate;
    if (select_inliers(blocks, excluded, light, gate) < enough) return {};
    light = start;  // its gains are the expected ones
    light.field_multiplies = multiplies;
    if (!fit_field(blocks, light)) return {};
    gate = std::max(kGateLevels, gate / 2);
  }
  return {light, select_inliers(blocks, excluded, light, kGateLevels)};
}

/// Rows and an even light in turn.
LightTracker::Fit LightTracker::refine_rows(const cv::Mat3f& blocks, const cv::Mat1b& excluded, Light light) {
  const int enough = static_cast<int>(2 * kLeastShare * static_cast<double>(blocks.total()));
  Fit best;
  for (int round = 0; round < 2; ++round) {
    Light rows;
    rows.row_gain = fit_rows(blocks, excluded, light);
    cv::Mat3f even = blocks.clone();
    to_background_light(rows, even);
    best = refine_even(even, excluded, light, light);
    if (best.agree < enough) return {};
    light = best.light;
    best.light.row_gain = rows.row_gain;
  }
  return best;
}

/// Light that jumped or is uneven, where the even light followed so far explains little.
LightTracker::Fit LightTracker::search(const cv::Mat3f& blocks, const cv::Mat1b& excluded,
                                       const Fit& followed) {
  const Light scaled = fit_by_median(blocks, excluded);
  Fit best = followed;
  const Fit jumped = refine_even(blocks, excluded, scaled, scaled);
  if (jumped.agree > kClearlyMore * best.agree) best = jumped;
  if (!may_be_uneven_) return best;
  Fit uneven = refine_rows(blocks, excluded, scaled);
  for (const bool multiplies : {false, true}) {
    for (const auto& [start, gate] :
         {std::pair(light_, kGateLevels), std::pair(scaled, std::ldexp(kGateLevels, kGateHalvings))}) {
      const Fit fit = refine_field(blocks, excluded, start, multiplies, gate);
      if (fit.agree > uneven.agree) uneven = fit;
    }
  }
  return uneven.agree > (light_.is_even() ? kClearlyMore : 1.0) * best.agree ? uneven : best;
}

const Light& LightTracker::update(const cv::Mat3f& blocks, const cv::Mat1b& touched) {
  const int total = static_cast<int>(blocks.total());
  int bare = touched.empty() ? total : total - cv::countNonZero(touched);
  // Light that was not followed looks like contact all over.
  const bool is_believable = bare >= kLeastShare * total;
  if (!is_believable) bare = total;
  const cv::Mat1b& excluded = is_believable && !touched.empty() ? touched : none_;
  Light even;
  for (std::size_t c = 0; c < 3; ++c) even.channels[c] = {light_.channels[c][0], light_.channels[c][1]};
  const int agree_last = select_inliers(blocks, excluded, even, kGateLevels);
  const int agree_unchanged = select_inliers(blocks, excluded, Light{}, kGateLevels);
  Light scaled;
  int agree_scaled = agree_unchanged;
  if (bare > kClearlyMore * std::min(agree_last, agree_unchanged)) {
    scaled = fit_by_median(blocks, excluded);
    agree_scaled = select_inliers(blocks, excluded, scaled, kGateLevels);
  }
  // A light that did not change explains as many blocks as one that follows their noise.
  const Light expected = agree_scaled > kClearlyMore * agree_unchanged ? scaled : Light{};
  Fit best =
      refine_even(blocks, excluded, expected, agree_scaled > kClearlyMore * agree_last ? scaled : even);
  const double share = static_cast<double>(best.agree) / bare;
  if (share >= kExplainedShare) {
    share_at_vain_search_ = 1.0;
  } else if (best.agree == 0 || share * kClearlyMore < share_at_vain_search_) {
    const int followed = best.agree;
    best = search(blocks, excluded, best);
    share_at_vain_search_ = best.agree > followed ? 1.0 : share;
  }
  if (best.agree > 0) light_ = best.light;
  return light_;
}

}  // namespace gelslam::surface::detail
