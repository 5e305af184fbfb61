#include "gelslam/calibration/optics_fit.hpp"

#include <fmt/core.h>

#include <algorithm>

#include "optics/optics_model.hpp"

namespace gelslam {
namespace {

constexpr std::array<const char*, OpticsFit::kNumbers> kNames = {
    "lens_k1",           "lens_center_px x", "lens_center_px y", "pixel_aspect", "camera_distance_mm",
    "gel_dome_per_mm x", "gel_dome_per_mm y"};

std::array<double, OpticsFit::kNumbers> values_of(const SensorOptics& o) {
  return {o.lens_k1,           o.lens_center_px[0],  o.lens_center_px[1],
          o.pixel_aspect,      o.camera_distance_mm, o.gel_dome_per_mm[0],
          o.gel_dome_per_mm[1]};
}

}  // namespace

namespace calibration::detail {

OpticsNumbers numbers_of(const SensorOptics& optics) {
  OpticsNumbers numbers = values_of(optics);
  numbers[4] = optics.inverse_distance();
  return numbers;
}

SensorOptics optics_of(const OpticsNumbers& numbers) {
  constexpr double kLeast = 1e-6;  // a kilometer
  return {numbers[0],
          {numbers[1], numbers[2]},
          numbers[3],
          numbers[4] > kLeast ? 1 / numbers[4] : 0,
          {numbers[5], numbers[6]}};
}

void conclude(const OpticsNumbers& found, const OpticsNumbers& variance, const SensorOptics& start,
              OpticsFit& fit) {
  constexpr double kShown = 0.5;  // of the prior's standard deviation
  OpticsNumbers kept = numbers_of(start);
  for (std::size_t k = 0; k < kept.size(); ++k) {
    fit.sigma[k] = std::sqrt(std::max(variance[k], 0.0));
    fit.shown[k] = fit.sigma[k] < kShown * kPriorSigma[k];
    if (fit.shown[k]) kept[k] = found[k];
  }
  fit.optics = optics_of(kept);
  fit.sigma[4] *= fit.optics.camera_distance_mm * fit.optics.camera_distance_mm;
}

}  // namespace calibration::detail

std::string OpticsFit::words() const {
  std::string text;
  const auto values = values_of(optics);
  for (std::size_t k = 0; k < kNumbers; ++k)
    text += !shown[k]       ? fmt::format("{}: {:.4g}, not shown\n", kNames[k], values[k])
            : sigma[k] == 0 ? fmt::format("{}: 0, orthographic\n", kNames[k])
                            : fmt::format("{}: {:.4g} +- {:.2g}\n", kNames[k], values[k], sigma[k]);
  return text;
}

std::string OpticsFit::not_shown() const {
  std::string text;
  for (std::size_t k = 0; k < kNumbers; ++k)
    if (!shown[k]) text += (text.empty() ? "" : ", ") + std::string(kNames[k]);
  return text;
}

}  // namespace gelslam
