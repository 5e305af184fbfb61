#include "color_field.hpp"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>

namespace gelslam::calibration::detail {
namespace {

constexpr int slope_degree = 4, place_degree = 4;
constexpr std::size_t wanted_rows = 30'000;
constexpr double typical_angle_rad = 0.3;
constexpr double ridge = 1e-5;  // of a term of degree 1, relative to the samples' own weight
constexpr double per_degree = 4.0;

/// x^(k-j) y^j for k from `first` to `last`.
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

/// Angles in units of the typical one, places from -1 to 1.
void terms(const std::array<float, 2>& place, const std::array<float, 2>& angle, float* slope_out,
           float* place_out) {
  constexpr auto unit = static_cast<float>(1.0 / typical_angle_rad);
  monomials<1, slope_degree>(angle[0] * unit, angle[1] * unit, slope_out);
  monomials<0, place_degree>(2.0F * place[0] - 1.0F, 2.0F * place[1] - 1.0F, place_out);
}

}  // namespace

ColorField::ColorField(const std::vector<SlopeSample>& samples) {
  constexpr Eigen::Index columns = slope_terms * place_terms;
  const std::size_t every = std::max<std::size_t>(1, samples.size() / wanted_rows);
  const auto rows = static_cast<Eigen::Index>((samples.size() + every - 1) / every);
  Eigen::MatrixXf features(rows, columns);
  Eigen::MatrixXf changes(rows, 3);
  for (Eigen::Index row = 0; row < rows; ++row) {
    const SlopeSample& sample = samples[static_cast<std::size_t>(row) * every];
    std::array<float, slope_terms> slope{};
    std::array<float, place_terms> place{};
    terms(sample.place, sample.angle_rad, slope.data(), place.data());
    for (int s = 0; s < slope_terms; ++s)
      for (int p = 0; p < place_terms; ++p)
        features(row, s * place_terms + p) =
            slope[static_cast<std::size_t>(s)] * place[static_cast<std::size_t>(p)];
    for (int c = 0; c < 3; ++c)
      changes(row, c) =
          sample.color[static_cast<std::size_t>(c)] - sample.flat_color[static_cast<std::size_t>(c)];
  }
  Eigen::MatrixXd information = (features.transpose() * features).cast<double>();
  int s = 0;
  for (int a = 1; a <= slope_degree; ++a)
    for (int i = 0; i <= a; ++i, ++s) {
      int p = 0;
      for (int b = 0; b <= place_degree; ++b)
        for (int j = 0; j <= b; ++j, ++p)
          information(s * place_terms + p, s * place_terms + p) +=
              ridge * static_cast<double>(rows) * std::pow(per_degree, a - 1 + b);
    }
  const Eigen::MatrixXd solution = information.ldlt().solve((features.transpose() * changes).cast<double>());
  for (int c = 0; c < 3; ++c)
    for (Eigen::Index k = 0; k < columns; ++k)
      coefficients_[static_cast<std::size_t>(c)][static_cast<std::size_t>(k)] =
          static_cast<float>(solution(k, c));
}

std::array<float, 3> ColorField::change(const std::array<float, 2>& place,
                                        const std::array<float, 2>& angle_rad) const {
  std::array<float, slope_terms> slope{};
  std::array<float, place_terms> places{};
  terms(place, angle_rad, slope.data(), places.data());
  std::array<float, 3> result{};
  for (std::size_t c = 0; c < 3; ++c) {
    const float* coefficient = coefficients_[c].data();
    for (int s = 0; s < slope_terms; ++s, coefficient += place_terms) {
      float sum = 0.0F;
      for (int p = 0; p < place_terms; ++p) sum += coefficient[p] * places[static_cast<std::size_t>(p)];
      result[c] += sum * slope[static_cast<std::size_t>(s)];
    }
  }
  return result;
}

}  // namespace gelslam::calibration::detail
