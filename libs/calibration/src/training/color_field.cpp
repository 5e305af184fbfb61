#include "training/color_field.hpp"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>

namespace gelslam::calibration::detail {
namespace {

constexpr int kSlopeDegree = 4, kPlaceDegree = 4;
constexpr std::size_t kWantedRows = 30'000;
constexpr double kTypicalAngleRad = 0.3;
constexpr double kRidge = 1e-5;  // of a term of degree 1, relative to the samples' own weight
constexpr double kPerDegree = 4.0;

/// x^(k-j) y^j for k from 0 to `degree`.
template <int degree>
void monomials(float x, float y, float* out) {
  float power_x[degree + 1], power_y[degree + 1];
  power_x[0] = power_y[0] = 1.0F;
  for (int k = 1; k <= degree; ++k) {
    power_x[k] = power_x[k - 1] * x;
    power_y[k] = power_y[k - 1] * y;
  }
  for (int k = 0; k <= degree; ++k)
    for (int j = 0; j <= k; ++j) *out++ = power_x[k - j] * power_y[j];
}

/// Angles in units of the typical one, places from -1 to 1.
void terms(const std::array<float, 2>& place, const std::array<float, 2>& angle, float* slope_out,
           float* place_out) {
  constexpr auto unit = static_cast<float>(1.0 / kTypicalAngleRad);
  monomials<kSlopeDegree>(angle[0] * unit, angle[1] * unit, slope_out);
  monomials<kPlaceDegree>(2.0F * place[0] - 1.0F, 2.0F * place[1] - 1.0F, place_out);
}

constexpr int kSlopeTerms = ColorField::kSlopeTerms, kPlaceTerms = ColorField::kPlaceTerms;
static_assert(kSlopeTerms == (kSlopeDegree + 1) * (kSlopeDegree + 2) / 2);
static_assert(kPlaceTerms == (kPlaceDegree + 1) * (kPlaceDegree + 2) / 2);
constexpr Eigen::Index kColumns = kSlopeTerms * kPlaceTerms;
constexpr float kDarkShare = 0.04F;  // keeps shares finite where there is no light

Eigen::VectorXd ridges() {
  Eigen::VectorXd result(kColumns);
  Eigen::Index column = 0;
  for (int a = 0; a <= kSlopeDegree; ++a)
    for (int i = 0; i <= a; ++i)
      for (int b = 0; b <= kPlaceDegree; ++b)
        for (int j = 0; j <= b; ++j) result[column++] = kRidge * std::pow(kPerDegree, std::max(0, a - 1) + b);
  return result;
}

}  // namespace

ColorField::ColorField(const std::vector<SlopeSample>& samples) {
  const std::size_t every = std::max<std::size_t>(1, samples.size() / kWantedRows);
  Eigen::MatrixXd features(static_cast<Eigen::Index>((samples.size() + every - 1) / every), kColumns);
  Eigen::MatrixX3d changes(features.rows(), 3);
  for (Eigen::Index row = 0; row < features.rows(); ++row) {
    const SlopeSample& sample = samples[static_cast<std::size_t>(row) * every];
    std::array<float, kSlopeTerms> slope{};
    std::array<float, kPlaceTerms> place{};
    terms(sample.place, sample.angle_rad, slope.data(), place.data());
    Eigen::Index column = 0;
    for (const float s : slope)
      for (const float p : place) features(row, column++) = static_cast<double>(s * p);
    for (std::size_t c = 0; c < 3; ++c)
      changes(row, static_cast<Eigen::Index>(c)) =
          static_cast<double>((sample.color[c] - sample.flat_color[c]) / unit(sample.flat_color[c]));
  }
  Eigen::MatrixXd information = features.transpose() * features;
  information.diagonal() += static_cast<double>(features.rows()) * ridges();
  const Eigen::MatrixX3d solution = information.ldlt().solve(features.transpose() * changes);
  for (std::size_t c = 0; c < 3; ++c)
    for (Eigen::Index k = 0; k < kColumns; ++k)
      coefficients_[c][static_cast<std::size_t>(k)] =
          static_cast<float>(solution(k, static_cast<Eigen::Index>(c)));
}

float ColorField::unit(float flat) { return flat + kDarkShare; }

std::array<float, 3> ColorField::change(const std::array<float, 2>& place,
                                        const std::array<float, 2>& angle_rad) const {
  std::array<float, kSlopeTerms> slope{};
  std::array<float, kPlaceTerms> places{};
  terms(place, angle_rad, slope.data(), places.data());
  std::array<float, 3> result{};
  for (std::size_t c = 0; c < 3; ++c) {
    const float* coefficient = coefficients_[c].data();
    std::array<float, kPlaceTerms> sums{};  // one per term of the place: they are added up side by side
    for (const float s : slope)
      for (float& sum : sums) sum += s * *coefficient++;
    for (std::size_t p = 0; p < sums.size(); ++p) result[c] += sums[p] * places[p];
  }
  return result;
}

}  // namespace gelslam::calibration::detail
