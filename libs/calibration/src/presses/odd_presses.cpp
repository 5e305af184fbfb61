#include "presses/odd_presses.hpp"

#include <algorithm>
#include <cmath>

#include "gelslam/core/median.hpp"
#include "training/color_field.hpp"

namespace gelslam::calibration::detail {
namespace {

constexpr int kWantedOddSamples = 12'000;
constexpr std::size_t kLeastZones = 10;  // to tell which one is odd
// Times the median residual. The oddest of 224 good presses of three sets: 2.4; two balls that overlap 2.7
// to 9.6, something oval 15.
constexpr double kOddResidual = 3.0;
constexpr double kMostOdd = 0.25;  // of the presses: more are no accident

/// Per zone, root mean square distance of its colors to the field's; of full brightness.
std::vector<double> residuals_to(const ColorField& field, const std::vector<SlopeSample>& samples,
                                 std::size_t zones) {
  std::vector<double> squared(zones, 0.0), count(zones, 1e-9);
  for (const SlopeSample& sample : samples) {
    const std::array<float, 3> expected = field.change(sample.place, sample.angle_rad);
    const auto zone = static_cast<std::size_t>(sample.zone);
    for (std::size_t c = 0; c < 3; ++c) {
      const float flat = sample.flat_color[c];
      const auto residual = static_cast<double>(sample.color[c] - flat - field.unit(flat) * expected[c]);
      squared[zone] += residual * residual;
    }
    count[zone] += 1.0;
  }
  for (std::size_t k = 0; k < zones; ++k) squared[k] = std::sqrt(squared[k] / count[k]);
  return squared;
}

}  // namespace

std::vector<std::size_t> find_odd_zones(const PressSet& set, const std::vector<BallZone>& zones,
                                        double pixel_pitch_mm) {
  std::vector<std::size_t> odd;
  if (zones.size() < kLeastZones) return odd;
  std::vector<SlopeSample> samples = zone_samples(set, zones, pixel_pitch_mm, kWantedOddSamples);
  const auto most = static_cast<std::size_t>(kMostOdd * static_cast<double>(zones.size()));
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

}  // namespace gelslam::calibration::detail
