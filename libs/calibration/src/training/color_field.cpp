// Two helpers of the training (not in the paper): a smooth model of color as a function of slope and place,
// by which samples are moved over the gel, and the compensation of regression to the mean. The model is
// fitted to absolute and to relative color changes, and five-fold cross-validation over presses chooses
// between them.

#include "training/color_field.hpp"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>

namespace gelslam::calibration::detail {

namespace {

SlopeSample sample_at(const cv::Mat3b& bgr, const cv::Mat3b& background, int u, int v) {
  SlopeSample sample;
  for (int channel = 0; channel < 3; ++channel) {
    const auto c = static_cast<std::size_t>(channel);
    sample.color[c] = static_cast<float>(bgr(v, u)[channel]) / 255.0F;
    sample.flat_color[c] = static_cast<float>(background(v, u)[channel]) / 255.0F;
  }
  sample.place = {static_cast<float>(u) / static_cast<float>(bgr.cols),
                  static_cast<float>(v) / static_cast<float>(bgr.rows)};
  sample.u_px = u;
  sample.v_px = v;
  return sample;
}

}  // namespace

std::vector<SlopeSample> zone_samples(const PressSet& set, const std::vector<BallZone>& zones,
                                      double pixel_pitch_mm, int wanted) {
  double area = 0.0;
  for (const BallZone& zone : zones) area += 3.1416 * zone.radius_px * zone.radius_px;
  // Uses every pixel if there are few, else every n-th one, counted through all zones.
  const int every = std::max(1, static_cast<int>(area / wanted));
  std::vector<SlopeSample> samples;
  int number = 0;
  for (std::size_t k = 0; k < zones.size(); ++k) {
    const BallZone& zone = zones[k];
    const CalibrationPress& press = set.presses[zone.press];
    const SeenBall ball(set.camera(pixel_pitch_mm), zone, press.diameter_mm);
    for_each_pixel(ball, press, [&](int u, int v, const Eigen::Vector2d& rest_mm) {
      if (number++ % every != 0) return;
      SlopeSample sample = sample_at(press.bgr, set.background, u, v);
      const auto slope = ball.slope(rest_mm);
      for (std::size_t axis = 0; axis < 2; ++axis)
        sample.angle_rad[axis] = static_cast<float>(std::atan(slope[axis]));
      sample.zone = static_cast<int>(k);
      samples.push_back(sample);
    });
  }
  return samples;
}
namespace {

constexpr int kSlopeDegree = 4, kPlaceDegree = 4;
constexpr std::size_t kWantedRows = 30'000;
constexpr double kTypicalAngleRad = 0.3;
constexpr double kRidge = 1e-5;  // Ridge of a term of degree 1, relative to the weight of the samples.
constexpr double kPerDegree = 4.0;

/// Writes the monomials x^(k-j) y^j for k from `first` to `last`.
template <int first, int last, class Number>
void monomials(Number x, Number y, Number* out) {
  Number power_x[last + 1], power_y[last + 1];
  power_x[0] = power_y[0] = Number(1);
  for (int k = 1; k <= last; ++k) {
    power_x[k] = power_x[k - 1] * x;
    power_y[k] = power_y[k - 1] * y;
  }
  for (int k = first; k <= last; ++k)
    for (int j = 0; j <= k; ++j) *out++ = power_x[k - j] * power_y[j];
}

/// Writes the terms of both polynomials. Angles are in units of the typical one, places are from -1 to 1.
void terms(const std::array<float, 2>& place, const std::array<float, 2>& angle, float* slope_out,
           float* place_out) {
  constexpr auto unit = static_cast<float>(1.0 / kTypicalAngleRad);
  monomials<0, kSlopeDegree>(angle[0] * unit, angle[1] * unit, slope_out);
  monomials<0, kPlaceDegree>(2.0F * place[0] - 1.0F, 2.0F * place[1] - 1.0F, place_out);
}

constexpr int kFolds = 5;
constexpr int kSlopeTerms = ColorField::kSlopeTerms, kPlaceTerms = ColorField::kPlaceTerms;
static_assert(kSlopeTerms == (kSlopeDegree + 1) * (kSlopeDegree + 2) / 2);
static_assert(kPlaceTerms == (kPlaceDegree + 1) * (kPlaceDegree + 2) / 2);
constexpr Eigen::Index kColumns = kSlopeTerms * kPlaceTerms;
constexpr float kDarkShare = 0.04F;  // Keeps relative changes finite in dark parts of the image.

/// The samples of some presses, for cross-validation: their features, the color changes in gray levels
/// (columns 0 to 2) and relative ones (3 to 5), and their normal equations.
struct Fold {
  explicit Fold(const std::vector<const SlopeSample*>& samples)
      : features(static_cast<Eigen::Index>(samples.size()), kColumns),
        changes(features.rows(), 6),
        levels_per_share(features.rows(), 3) {
    for (Eigen::Index row = 0; row < features.rows(); ++row)
      fill(row, *samples[static_cast<std::size_t>(row)]);
    information = (features.transpose() * features).cast<double>();
    right = (features.transpose() * changes).cast<double>();
  }

  void fill(Eigen::Index row, const SlopeSample& sample) {
    std::array<float, kSlopeTerms> slope{};
    std::array<float, kPlaceTerms> place{};
    terms(sample.place, sample.angle_rad, slope.data(), place.data());
    Eigen::Index column = 0;
    for (const float s : slope)
      for (const float p : place) features(row, column++) = s * p;
    for (int c = 0; c < 3; ++c) {
      const float flat = sample.flat_color[static_cast<std::size_t>(c)];
      levels_per_share(row, c) = flat + kDarkShare;
      changes(row, c) = sample.color[static_cast<std::size_t>(c)] - flat;
      changes(row, 3 + c) = changes(row, c) / levels_per_share(row, c);
    }
  }

  double rows() const { return static_cast<double>(features.rows()); }

  Eigen::MatrixXf features;
  Eigen::Matrix<float, Eigen::Dynamic, 6> changes;
  Eigen::Matrix<float, Eigen::Dynamic, 3> levels_per_share;
  Eigen::MatrixXd information, right;
};

/// Distributes the samples to folds by their press, so that all samples of a press, which share its errors,
/// are left out together.
std::vector<Fold> deal(const std::vector<SlopeSample>& samples) {
  const std::size_t every = std::max<std::size_t>(1, samples.size() / kWantedRows);
  std::array<std::vector<const SlopeSample*>, kFolds> split;
  for (std::size_t k = 0; k < samples.size(); k += every)
    split[static_cast<std::size_t>(samples[k].zone % kFolds)].push_back(&samples[k]);
  return {split.begin(), split.end()};
}

Eigen::VectorXd ridges() {
  Eigen::VectorXd result(kColumns);
  Eigen::Index column = 0;
  for (int a = 0; a <= kSlopeDegree; ++a)
    for (int i = 0; i <= a; ++i)
      for (int b = 0; b <= kPlaceDegree; ++b)
        for (int j = 0; j <= b; ++j) result[column++] = kRidge * std::pow(kPerDegree, std::max(0, a - 1) + b);
  return result;
}

/// Solves for the coefficients, one column per channel and kind of change.
Eigen::MatrixXd solve(Eigen::MatrixXd information, const Eigen::MatrixXd& right, double rows) {
  information.diagonal() += rows * ridges();
  return information.ldlt().solve(right);
}

/// Returns the squared errors in gray levels on the samples of a fold, for both kinds of change.
Eigen::Array2d errors_on(const Fold& fold, const Eigen::MatrixXd& solution) {
  const Eigen::MatrixXf left = fold.changes - fold.features * solution.cast<float>();
  return {static_cast<double>(left.leftCols<3>().squaredNorm()),
          static_cast<double>(left.rightCols<3>().cwiseProduct(fold.levels_per_share).squaredNorm())};
}

}  // namespace

ColorField::ColorField(const std::vector<SlopeSample>& samples) {
  const std::vector<Fold> parts = deal(samples);
  Eigen::MatrixXd information = Eigen::MatrixXd::Zero(kColumns, kColumns),
                  right = Eigen::MatrixXd::Zero(kColumns, 6);
  double rows = 0.0;
  for (const Fold& part : parts) {
    information += part.information;
    right += part.right;
    rows += part.rows();
  }
  Eigen::Array2d errors = Eigen::Array2d::Zero();
  for (const Fold& part : parts)
    errors += errors_on(part, solve(information - part.information, right - part.right, rows - part.rows()));
  relative_ = errors[1] < errors[0];
  const Eigen::MatrixXd solution = solve(information, right, rows);
  for (int c = 0; c < 3; ++c)
    for (Eigen::Index k = 0; k < kColumns; ++k)
      coefficients_[static_cast<std::size_t>(c)][static_cast<std::size_t>(k)] =
          static_cast<float>(solution(k, relative_ ? 3 + c : c));
}

float ColorField::unit(float flat) const { return relative_ ? flat + kDarkShare : 1.0F; }

std::array<float, 3> ColorField::change(const std::array<float, 2>& place,
                                        const std::array<float, 2>& angle_rad) const {
  std::array<float, kSlopeTerms> slope{};
  std::array<float, kPlaceTerms> places{};
  terms(place, angle_rad, slope.data(), places.data());
  std::array<float, 3> result{};
  for (std::size_t c = 0; c < 3; ++c) {
    const float* coefficient = coefficients_[c].data();
    // One sum per term of the place, so that the compiler can vectorize the additions.
    std::array<float, kPlaceTerms> sums{};
    for (const float s : slope)
      for (float& sum : sums) sum += s * *coefficient++;
    for (std::size_t p = 0; p < sums.size(); ++p) result[c] += sums[p] * places[p];
  }
  return result;
}

void ScaleField::Regression::note(double read, double truth) {
  read_true += read * truth;
  true_true += truth * truth;
}

void ScaleField::Regression::update() {
  constexpr double keep = 0.98, follow = 0.02, bound = 1.25, enough = 1e-3;
  if (true_true > enough)
    stretch = std::clamp(stretch * (1.0 + follow * (1.0 - read_true / true_true)), 1.0 / bound, bound);
  read_true *= keep;
  true_true *= keep;
}

void ScaleField::note(const Pair& place, const Pair& read, const Pair& truth) {
  const auto third = [](float along) {
    return std::min<std::size_t>(2, static_cast<std::size_t>(3.0F * along));
  };
  const std::size_t ninth = 3 * third(place[1]) + third(place[0]);
  const auto steepness = std::hypot(static_cast<double>(truth[0]), static_cast<double>(truth[1]));
  const auto step = std::min(kSteps - 1, static_cast<std::size_t>(steepness / kStepRad));
  for (std::size_t axis = 0; axis < 2; ++axis) {
    by_place_[axis][ninth].note(static_cast<double>(read[axis]), static_cast<double>(truth[axis]));
    by_steepness_[step].note(static_cast<double>(read[axis]), static_cast<double>(truth[axis]));
  }
}

void ScaleField::update() {
  for (auto& axis : by_place_)
    for (Regression& ninth : axis) ninth.update();
  for (Regression& step : by_steepness_) step.update();
}

ScaleField::Pair ScaleField::stretched(const Pair& place, const Pair& truth) const {
  const double x = std::clamp(3.0 * static_cast<double>(place[0]) - 0.5, 0.0, 2.0),
               y = std::clamp(3.0 * static_cast<double>(place[1]) - 0.5, 0.0, 2.0);
  const auto column = std::min<std::size_t>(1, static_cast<std::size_t>(x)),
             row = std::min<std::size_t>(1, static_cast<std::size_t>(y));
  const double right = x - static_cast<double>(column), down = y - static_cast<double>(row);
  const double along =
      std::clamp(std::hypot(static_cast<double>(truth[0]), static_cast<double>(truth[1])) / kStepRad - 0.5,
                 0.0, kSteps - 1.0);
  const auto step = std::min(kSteps - 2, static_cast<std::size_t>(along));
  const double up = along - static_cast<double>(step);
  const double steep = (1.0 - up) * by_steepness_[step].stretch + up * by_steepness_[step + 1].stretch;
  Pair result{};
  for (std::size_t axis = 0; axis < 2; ++axis) {
    const auto at = [&](std::size_t r, std::size_t c) { return by_place_[axis][3 * r + c].stretch; };
    const double placed = (1.0 - down) * ((1.0 - right) * at(row, column) + right * at(row, column + 1)) +
                          down * ((1.0 - right) * at(row + 1, column) + right * at(row + 1, column + 1));
    result[axis] = static_cast<float>(placed * steep) * truth[axis];
  }
  return result;
}

}  // namespace gelslam::calibration::detail
