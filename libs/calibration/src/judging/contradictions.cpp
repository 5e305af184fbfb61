#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>

#include "gelslam/calibration/ball_zones.hpp"
#include "gelslam/core/median.hpp"
#include "training/color_field.hpp"

namespace gelslam {
namespace {

using namespace calibration::detail;

constexpr int kWantedOddSamples = 12'000;
constexpr std::size_t kMinZonesToJudge = 10;  // to tell which one is odd
// Times the median residual. The oddest of 224 good presses of three sets: 2.4; two balls that overlap 2.7
// to 9.6, something oval 15.
constexpr double kOddResidual = 3.0;
constexpr double kMaxOdd = 0.25;  // of the presses: more are no accident

/// Squared distance of a sample's color to the field's, if its slope is `factor` times as steep; of full
/// brightness.
double squared_residual(const ColorField& field, const SlopeSample& sample, float factor) {
  const std::array<float, 3> expected =
      field.change(sample.place, {factor * sample.angle_rad[0], factor * sample.angle_rad[1]});
  double squared = 0.0;
  for (std::size_t c = 0; c < 3; ++c) {
    const float flat = sample.flat_color[c];
    const auto residual = static_cast<double>(sample.color[c] - flat - field.unit(flat) * expected[c]);
    squared += residual * residual;
  }
  return squared;
}

/// Root mean square of them in every zone; 0 where it has no samples.
std::vector<double> residuals_to(const ColorField& field, const std::vector<SlopeSample>& samples,
                                 std::size_t zones) {
  std::vector<double> squared(zones, 0.0), count(zones, 1e-9);
  for (const SlopeSample& sample : samples) {
    squared[static_cast<std::size_t>(sample.zone)] += squared_residual(field, sample, 1.0F);
    count[static_cast<std::size_t>(sample.zone)] += 1.0;
  }
  for (std::size_t k = 0; k < zones; ++k) squared[k] = std::sqrt(squared[k] / count[k]);
  return squared;
}

constexpr std::size_t kMinZones = 5;
constexpr int kWantedSizeSamples = 12'000;
constexpr double kMaxAngleRad = 0.4;  // compared: steeper ones may not have been seen of the larger ball
constexpr double kMinFactor = 0.4, kMaxFactor = 2.5, kFactorStep = 1.02;
constexpr double kRobustChange = 0.02;  // of full brightness
// Or its inverse. Three sets with right diameters: 1.00 to 1.02; diameters 11 % off: 1.09 to 1.14.
constexpr double kMaxSteepness = 1.08;

double residual(const ColorField& field, const std::vector<SlopeSample>& samples, double factor) {
  double sum = 0.0;
  for (const SlopeSample& sample : samples) {
    if (std::hypot(sample.angle_rad[0], sample.angle_rad[1]) > static_cast<float>(kMaxAngleRad)) continue;
    const double squared = squared_residual(field, sample, static_cast<float>(factor));
    sum += std::sqrt(1.0 + squared / (kRobustChange * kRobustChange)) - 1.0;
  }
  return sum;
}

/// Factor on the angles of `samples` that a field of another ball's colors explains best.
double steepness_by(const ColorField& field, const std::vector<SlopeSample>& samples) {
  double best = 1.0, least = std::numeric_limits<double>::infinity();
  for (double factor = kMinFactor; factor <= kMaxFactor; factor *= kFactorStep) {
    const double cost = residual(field, samples, factor);
    if (cost >= least) continue;
    least = cost;
    best = factor;
  }
  return best;
}

}  // namespace

std::vector<std::size_t> find_odd_zones(const PressSet& set, const std::vector<BallZone>& zones,
                                        double pixel_pitch_mm) {
  std::vector<std::size_t> odd;
  if (zones.size() < kMinZonesToJudge) return odd;
  std::vector<SlopeSample> samples = zone_samples(set, zones, pixel_pitch_mm, kWantedOddSamples);
  const auto most = static_cast<std::size_t>(kMaxOdd * static_cast<double>(zones.size()));
  while (odd.size() < most && !samples.empty()) {
    const std::vector<double> residuals = residuals_to(ColorField(samples), samples, zones.size());
    std::vector<double> others;
    for (const double residual : residuals)
      if (residual > 0.0) others.push_back(residual);
    const auto worst = std::max_element(residuals.begin(), residuals.end());
    if (*worst <= kOddResidual * median(others)) break;
    const auto zone = static_cast<std::size_t>(worst - residuals.begin());
    odd.push_back(zone);
    std::erase_if(samples, [&](const SlopeSample& s) { return s.zone == static_cast<int>(zone); });
  }
  std::ranges::sort(odd);
  return odd;
}

std::vector<BallSizeComparison> compare_ball_sizes(const PressSet& set, const std::vector<BallZone>& zones,
                                                   double pixel_pitch_mm) {
  std::map<double, std::vector<BallZone>> by_size;
  for (const BallZone& zone : zones) by_size[set.presses[zone.press].diameter_mm].push_back(zone);
  std::erase_if(by_size, [](const auto& size) { return size.second.size() < kMinZones; });
  std::vector<BallSizeComparison> comparisons;
  if (by_size.size() < 2) return comparisons;
  const auto first = by_size.begin();
  const std::vector<SlopeSample> samples =
      zone_samples(set, first->second, pixel_pitch_mm, kWantedSizeSamples);
  const ColorField field(samples);
  for (auto other = std::next(first); other != by_size.end(); ++other) {
    const std::vector<SlopeSample> others =
        zone_samples(set, other->second, pixel_pitch_mm, kWantedSizeSamples);
    const double forth = steepness_by(field, others), back = steepness_by(ColorField(others), samples);
    comparisons.push_back({first->first, other->first, std::sqrt(forth / back)});
  }
  return comparisons;
}

std::string contradiction_between_sizes(const std::vector<BallSizeComparison>& comparisons) {
  for (const BallSizeComparison& pair : comparisons) {
    if (pair.steepness < kMaxSteepness && pair.steepness > 1.0 / kMaxSteepness) continue;
    return fmt::format(
        "the balls of {:.2f} and {:.2f} mm contradict each other: by its colors the second is {:.0f} % {} "
        "than that; one diameter in catalog.csv is wrong, or the camera has moved since background.png was "
        "taken",
        pair.diameter_mm, pair.other_diameter_mm, 100.0 * std::abs(1.0 / pair.steepness - 1.0),
        pair.steepness > 1.0 ? "smaller" : "larger");
  }
  return "";
}

}  // namespace gelslam
