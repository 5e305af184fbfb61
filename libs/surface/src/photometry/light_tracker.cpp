#include "photometry/light_tracker.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <opencv2/core.hpp>
#include <optional>
#include <utility>

#include "gelslam/core/median.hpp"

namespace gelslam::surface::detail {
namespace {

constexpr double gate_gray_levels =
    2.5;  // noise of a block mean is below 1; a slope of 1 degree changes color by 2.7
constexpr double min_inlier_share = 0.1;
constexpr double switch_advantage =
    1.3;  // a contact that covers half the gel must not look like a change of light
// Variance of the background's brightness below which gain and offset cannot be told apart and gain stays 1.
constexpr double gain_prior_variance = 4.0;

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

/// Sums of a least squares fit of a change by the background, 1 and, of a field, x, y, x², xy, y².
template <int terms>
class NormalEquations {
 public:
  void add(const std::array<double, terms>& term, double change) {
    for (std::size_t i = 0; i < terms; ++i) {
      for (std::size_t k = i; k < terms; ++k) square_[i][k] += term[i] * term[k];
      product_[i] += term[i] * change;
    }
  }

  /// Many at once, of the background and 1 alone: every frame needs these, and they stay in registers.
  void add(double then_squares, double then_sum, double count, double then_changes, double changes) {
    square_[0][0] += then_squares;
    square_[0][1] += then_sum;
    square_[1][1] += count;
    product_[0] += then_changes;
    product_[1] += changes;
  }

  std::optional<cv::Vec<double, terms>> solve() const {
    cv::Matx<double, terms, terms> square;
    for (int i = 0; i < terms; ++i)
      for (int k = 0; k < terms; ++k)
        square(i, k) =
            square_[static_cast<std::size_t>(std::min(i, k))][static_cast<std::size_t>(std::max(i, k))];
    const double count = square(1, 1);
    square(0, 0) += (terms == even_terms ? gain_prior_variance : uneven_gain_prior_variance) * count;
    for (int i = even_terms; i < terms; ++i) square(i, i) += field_prior_share * count;
    cv::Vec<double, terms> solution;
    if (!cv::solve(square, cv::Vec<double, terms>(product_.data()), solution, cv::DECOMP_CHOLESKY))
      return std::nullopt;
    return solution;
  }

 private:
  std::array<std::array<double, terms>, terms> square_{};  // its upper triangle
  std::array<double, terms> product_{};
};

}  // namespace

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
    const unsigned char* is_excluded = excluded.empty() ? nullptr : excluded[row];
    for (int column = 0; column < blocks.cols; ++column) {
      const cv::Vec3f &now = blocks(row, column), &background = background_(row, column);
      const double x = has_field ? unit_place(column, blocks.cols) : 0.0;
      double squared_residual = 0.0;
      for (std::size_t c = 0; c < 3; ++c) {
        const double then = background[static_cast<int>(c)];
        double residual = now[static_cast<int>(c)] - row_gain * (light.gain[c] * then + light.offset[c]);
        if (has_field) residual -= field_at(light.field[c], x, y) * field_scale(light.unevenness, then);
        squared_residual += residual * residual;
      }
      const bool agrees =
          squared_residual < squared_gate && (is_excluded == nullptr || is_excluded[column] == 0);
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
  std::array<NormalEquations<terms>, 3> channels;
  for (int row = 0; row < blocks.rows; ++row)
    for (std::size_t c = 0; c < 3; ++c) {
      const int channel = static_cast<int>(c);
      const double y = unit_place(row, blocks.rows);
      double count = 0.0, then_sum = 0.0, then_squares = 0.0, changes = 0.0, then_changes = 0.0;
      for (int column = 0; column < blocks.cols; ++column) {
        if (inliers_(row, column) == 0) continue;
        const double then = background_(row, column)[channel];
        const double change = blocks(row, column)[channel] - expected[c] * then;
        if constexpr (terms == even_terms) {
          count += 1.0;
          then_sum += then;
          then_squares += then * then;
          changes += change;
          then_changes += then * change;
        } else {
          const double x = unit_place(column, blocks.cols), scale = field_scale(unevenness, then);
          channels[c].add({then, 1.0, scale * x, scale * y, scale * x * x, scale * x * y, scale * y * y},
                          change);
        }
      }
      if constexpr (terms == even_terms)
        channels[c].add(then_squares, then_sum, count, then_changes, changes);
    }
  for (std::size_t c = 0; c < 3; ++c) {
    const auto solution = channels[c].solve();
    if (!solution) return false;
    light.gain[c] = expected[c] + (*solution)[0];
    light.offset[c] = (*solution)[1];
    for (int i = even_terms; i < terms; ++i)
      light.field[c][static_cast<std::size_t>(i - even_terms)] = (*solution)[i];
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

/// What the median over each row says. Colors are summed: a slope takes from one what it gives to another.
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
    cv::Mat3f even = blocks.clone();
    remove_field(bands, even);
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
