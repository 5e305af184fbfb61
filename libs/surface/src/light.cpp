#include "light.hpp"

#include <algorithm>
#include <cmath>
#include <opencv2/core.hpp>
#include <utility>
#include <vector>

#include "gelslam/core/median.hpp"

namespace gelslam::surface::detail {
namespace {

constexpr double gate_gray_levels =
    2.5;  // noise of a block mean is below 1; a slope of 1 degree changes colour by 2.7
constexpr double min_inlier_share = 0.1;
constexpr double switch_advantage =
    1.3;  // a contact that covers half the gel must not look like a change of light
// Variance of the background's brightness below which gain and offset cannot be told apart and gain stays 1.
constexpr double gain_prior_variance = 4.0;
// A lamp so weak tells no slopes; a gain so large is none of the lamps'.
constexpr double least_gain = 0.2, largest_gain = 3.0;

// Light from one side. Sudden light is found from far off, and the gate closes on it.
constexpr double wide_gate_gray_levels = 20.0;
constexpr double gate_shrinks = 0.6;
constexpr double near_gate_gray_levels = 6.0;
constexpr double even_enough_share = 0.6;            // of the blocks not excluded: no need to look for more
constexpr double least_uneven_share = 0.25;          // of all blocks, to believe in a field at all
constexpr double bands_advantage = 1.15;             // so many unknowns describe a part of anything
constexpr std::size_t least_row_share = 8;           // one in so many of a row's blocks
constexpr double uneven_gain_prior_variance = 50.0;  // a field does what a gain over a smooth background does
constexpr double field_prior_share = 0.002;          // keeps the field 0 where too little is seen

constexpr int even_terms = 2, uneven_terms = 7;

double unit_place(int index, int count) { return count < 2 ? 0.0 : 2.0 * index / (count - 1) - 1.0; }

double field_at(const std::array<double, 5>& field, double x, double y) {
  return field[0] * x + field[1] * y + field[2] * x * x + field[3] * x * y + field[4] * y * y;
}

/// What the field makes of a colour, relative to the background, in each of the two ways.
double field_scale(Unevenness unevenness, double then) {
  return unevenness == Unevenness::multiplied ? then / 128.0 : 1.0;
}

double row_gain_at(const std::vector<double>& rows, double y) {
  const double place = (y + 1.0) / 2.0 * static_cast<double>(rows.size() - 1);
  const auto above = std::min(static_cast<std::size_t>(place), rows.size() - 1),
             below = std::min(above + 1, rows.size() - 1);
  return std::lerp(rows[above], rows[below], place - static_cast<double>(above));
}

/// A channel's value without the field.
double without_field(const Light& light, std::size_t channel, double seen, double x, double y) {
  if (light.unevenness == Unevenness::banded) return seen / row_gain_at(light.row_gain, y);
  const double field = field_at(light.field[channel], x, y);
  if (light.unevenness == Unevenness::added) return seen - field;
  const double gain = light.gain[channel], offset = light.offset[channel];
  return offset + (seen - offset) * gain / std::max(least_gain / 2, gain + field / 128.0);
}

template <typename Pixel>
void remove_field_from(const Light& light, const cv::Mat_<Pixel>& from, cv::Mat_<Pixel>& to) {
  to.create(from.size());
  for (int v = 0; v < from.rows; ++v) {
    const double y = unit_place(v, from.rows);
    for (int u = 0; u < from.cols; ++u) {
      const double x = unit_place(u, from.cols);
      for (std::size_t c = 0; c < 3; ++c) {
        const int channel = static_cast<int>(c);
        to(v, u)[channel] =
            cv::saturate_cast<typename Pixel::value_type>(without_field(light, c, from(v, u)[channel], x, y));
      }
    }
  }
}

}  // namespace

ColorTable color_table(const Light& light) {
  ColorTable table;
  for (std::size_t c = 0; c < 3; ++c) {
    for (std::size_t value = 0; value < 256; ++value) {
      table[c][value] = static_cast<float>((static_cast<double>(value) - light.offset[c]) / light.gain[c]);
    }
  }
  return table;
}

void remove_field(const Light& light, const cv::Mat3b& bgr, cv::Mat3b& even) {
  remove_field_from(light, bgr, even);
}
void remove_field(const Light& light, cv::Mat3f& means) { remove_field_from(light, means, means); }

void to_background_light(const Light& light, cv::Mat3f& means) {
  for (cv::Vec3f& mean : means) {
    for (std::size_t c = 0; c < 3; ++c) {
      float& value = mean[static_cast<int>(c)];
      value = static_cast<float>((static_cast<double>(value) - light.offset[c]) / light.gain[c]);
    }
  }
}

LightTracker::LightTracker(const cv::Mat3f& background_blocks, bool uneven)
    : background_(background_blocks.clone()),
      may_be_uneven_(uneven),
      inliers_(background_blocks.size(), static_cast<unsigned char>(0)) {}

int LightTracker::select_inliers(const cv::Mat3f& blocks, const cv::Mat1b& excluded, const Light& light,
                                 double gate) {
  const bool has_field = light.unevenness == Unevenness::added || light.unevenness == Unevenness::multiplied;
  const bool has_bands = light.unevenness == Unevenness::banded;
  const double squared_gate = gate * gate;
  int count = 0;
  for (int row = 0; row < blocks.rows; ++row) {
    const double y = unit_place(row, blocks.rows);
    const double row_gain = has_bands ? light.row_gain[static_cast<std::size_t>(row)] : 1.0;
    for (int column = 0; column < blocks.cols; ++column) {
      double squared_residual = 0.0;
      for (std::size_t c = 0; c < 3; ++c) {
        const int channel = static_cast<int>(c);
        const double then = background_(row, column)[channel];
        double residual = blocks(row, column)[channel] - row_gain * (light.gain[c] * then + light.offset[c]);
        if (has_field) {
          const double x = unit_place(column, blocks.cols);
          residual -= field_at(light.field[c], x, y) * field_scale(light.unevenness, then);
        }
        squared_residual += residual * residual;
      }
      const bool agrees = (excluded.empty() || excluded(row, column) == 0) && squared_residual < squared_gate;
      inliers_(row, column) = agrees ? 1 : 0;
      count += agrees ? 1 : 0;
    }
  }
  return count;
}

/// To the inliers, with gains near the expected ones. False where the light that they tell cannot be.
template <int terms>
bool LightTracker::fit(const cv::Mat3f& blocks, Unevenness unevenness, const Gains& expected,
                       Light& light) const {
  using Terms = cv::Vec<double, terms>;  // background, 1 and, of a field, x, y, x², xy, y²
  for (std::size_t c = 0; c < 3; ++c) {
    const int channel = static_cast<int>(c);
    cv::Matx<double, terms, terms> square;
    Terms product;
    for (int row = 0; row < blocks.rows; ++row) {
      const double y = unit_place(row, blocks.rows);
      for (int column = 0; column < blocks.cols; ++column) {
        if (inliers_(row, column) == 0) continue;
        const double then = background_(row, column)[channel];
        const double change = blocks(row, column)[channel] - expected[c] * then;
        Terms term;
        term[0] = then;
        term[1] = 1.0;
        if constexpr (terms == uneven_terms) {
          const double x = unit_place(column, blocks.cols), scale = field_scale(unevenness, then);
          const double places[] = {x, y, x * x, x * y, y * y};
          for (int i = even_terms; i < terms; ++i) term[i] = scale * places[i - even_terms];
        }
        for (int i = 0; i < terms; ++i) {
          for (int k = i; k < terms; ++k) square(i, k) += term[i] * term[k];
          product[i] += term[i] * change;
        }
      }
    }
    const double count = square(1, 1);
    square(0, 0) += (terms == even_terms ? gain_prior_variance : uneven_gain_prior_variance) * count;
    for (int i = even_terms; i < terms; ++i) square(i, i) += field_prior_share * count;
    for (int i = 0; i < terms; ++i)
      for (int k = 0; k < i; ++k) square(i, k) = square(k, i);
    Terms solution;
    if (!cv::solve(square, product, solution, cv::DECOMP_CHOLESKY)) return false;
    light.gain[c] = expected[c] + solution[0];
    light.offset[c] = solution[1];
    for (int i = even_terms; i < terms; ++i)
      light.field[c][static_cast<std::size_t>(i - even_terms)] = solution[i];
    if (light.gain[c] < least_gain || light.gain[c] > largest_gain) return false;
  }
  light.unevenness = unevenness;
  return true;
}

/// What the median over the blocks says, per channel: of the change, or of its ratio.
Light LightTracker::fit_by_median(const cv::Mat3f& blocks, const cv::Mat1b& excluded, bool as_gain) const {
  Light light;
  std::vector<double> changes;
  changes.reserve(blocks.total());
  for (std::size_t c = 0; c < 3; ++c) {
    const int channel = static_cast<int>(c);
    changes.clear();
    for (int row = 0; row < blocks.rows; ++row) {
      for (int column = 0; column < blocks.cols; ++column) {
        if (!excluded.empty() && excluded(row, column) != 0) continue;
        const float seen = blocks(row, column)[channel], then = background_(row, column)[channel];
        changes.push_back(as_gain ? seen / std::max(then, 1.0F) : seen - then);
      }
    }
    if (changes.empty()) return {};
    if (as_gain)
      light.gain[c] = std::clamp(median(changes), least_gain, largest_gain);
    else
      light.offset[c] = median(changes);
  }
  return light;
}

/// The same light everywhere, fitted three times over.
LightTracker::Fit LightTracker::refine_even(const cv::Mat3f& blocks, const cv::Mat1b& excluded, Light light) {
  const int enough = static_cast<int>(min_inlier_share * static_cast<double>(blocks.total()));
  for (int iteration = 0; iteration < 3; ++iteration) {
    if (select_inliers(blocks, excluded, light, gate_gray_levels) < enough ||
        !fit<even_terms>(blocks, Unevenness::none, Light{}.gain, light))
      return {};
  }
  return {light, select_inliers(blocks, excluded, light, gate_gray_levels)};
}

/// With a field, fitted again and again while the gate closes.
LightTracker::Fit LightTracker::refine_uneven(const cv::Mat3f& blocks, const cv::Mat1b& excluded, Light light,
                                              Unevenness unevenness, double gate) {
  const int enough = static_cast<int>(least_uneven_share * static_cast<double>(blocks.total()));
  const Gains expected = unevenness == Unevenness::multiplied ? light.gain : Light{}.gain;
  int left_at_last_gate = 3;
  while (left_at_last_gate > 0) {
    if (gate == gate_gray_levels) --left_at_last_gate;
    if (select_inliers(blocks, excluded, light, gate) < enough ||
        !fit<uneven_terms>(blocks, unevenness, expected, light))
      return {};
    gate = std::max(gate_gray_levels, gate_shrinks * gate);
  }
  return {light, select_inliers(blocks, excluded, light, gate_gray_levels)};
}

/// What the median over each row says. Colours are summed: a slope takes from one what it gives to another.
/// Rows that are covered are as those above them.
std::vector<double> LightTracker::fit_rows(const cv::Mat3f& blocks, const cv::Mat1b& excluded,
                                           const Light& light) const {
  std::vector<double> gains, ratios;
  for (int row = 0; row < blocks.rows; ++row) {
    ratios.clear();
    for (int column = 0; column < blocks.cols; ++column) {
      if (!excluded.empty() && excluded(row, column) != 0) continue;
      double seen = 0.0, expected = 0.0;
      for (std::size_t c = 0; c < 3; ++c) {
        seen += blocks(row, column)[static_cast<int>(c)];
        expected += light.gain[c] * background_(row, column)[static_cast<int>(c)] + light.offset[c];
      }
      ratios.push_back(seen / std::max(expected, 1.0));
    }
    const double above = gains.empty() ? 1.0 : gains.back();
    const bool is_seen = ratios.size() * least_row_share >= static_cast<std::size_t>(blocks.cols);
    gains.push_back(is_seen ? std::clamp(median(ratios), least_gain, largest_gain) : above);
  }
  return gains;
}

/// Rows and the light of all of them in turn.
LightTracker::Fit LightTracker::refine_banded(const cv::Mat3f& blocks, const cv::Mat1b& excluded,
                                              Light light) {
  const int enough = static_cast<int>(least_uneven_share * static_cast<double>(blocks.total()));
  Fit best;
  for (int round = 0; round < 2; ++round) {
    Light bands;
    bands.row_gain = fit_rows(blocks, excluded, light);
    bands.unevenness = Unevenness::banded;
    cv::Mat3f even;
    remove_field_from(bands, blocks, even);
    best = refine_even(even, excluded, light);
    if (best.agree < enough) return {};
    light = best.light;
    best.light.row_gain = bands.row_gain;
    best.light.unevenness = Unevenness::banded;
  }
  return best;
}

/// Light that jumped, or that comes from one side, where the even light followed so far explains little.
LightTracker::Fit LightTracker::search(const cv::Mat3f& blocks, const cv::Mat1b& excluded,
                                       const Fit& followed) {
  const Light scaled = fit_by_median(blocks, excluded, true);
  Fit best = followed;
  const Fit jumped = refine_even(blocks, excluded, scaled);
  if (jumped.agree > switch_advantage * best.agree) best = jumped;
  if (!may_be_uneven_) return best;
  Fit uneven;
  for (const Unevenness unevenness : {Unevenness::added, Unevenness::multiplied}) {
    for (const auto& [start, gate] :
         {std::pair(light_, near_gate_gray_levels), std::pair(scaled, wide_gate_gray_levels)}) {
      const Fit fit = refine_uneven(blocks, excluded, start, unevenness, gate);
      if (fit.agree > uneven.agree) uneven = fit;
    }
  }
  const Fit banded = refine_banded(blocks, excluded, scaled);
  if (banded.agree > bands_advantage * uneven.agree) uneven = banded;
  const bool was_uneven = light_.unevenness != Unevenness::none;
  return uneven.agree > (was_uneven ? 1.0 : switch_advantage) * best.agree ? uneven : best;
}

const Light& LightTracker::update(const cv::Mat3f& blocks, const cv::Mat1b& touched) {
  const int total = static_cast<int>(blocks.total());
  int bare = touched.empty() ? total : total - cv::countNonZero(touched);
  // Light that was not followed looks like contact all over.
  const bool is_believable = bare >= min_inlier_share * total;
  if (!is_believable) bare = total;
  const cv::Mat1b excluded = is_believable ? touched : cv::Mat1b();
  Light even = light_;
  even.field = {};
  even.row_gain.clear();
  even.unevenness = Unevenness::none;
  const Light shifted = fit_by_median(blocks, excluded, false);
  const int agree_shifted = select_inliers(blocks, excluded, shifted, gate_gray_levels);
  const int agree_last = select_inliers(blocks, excluded, even, gate_gray_levels);
  Fit best = refine_even(blocks, excluded, agree_shifted > switch_advantage * agree_last ? shifted : even);
  const double share = static_cast<double>(best.agree) / bare;
  if (share >= even_enough_share) {
    vain_share_ = 1.0;
  } else if (best.agree == 0 || share * switch_advantage < vain_share_) {
    const int followed = best.agree;
    best = search(blocks, excluded, best);
    vain_share_ = best.agree > followed ? 1.0 : share;
  }
  if (best.agree > 0) light_ = best.light;
  return light_;
}

}  // namespace gelslam::surface::detail
