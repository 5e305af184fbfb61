#pragma once

#include <array>
#include <functional>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "gelslam/calibration/ball_zones.hpp"
#include "gelslam/calibration/slope_statistics.hpp"
#include "gelslam/surface/gradient_model.hpp"

namespace gelslam {

struct PressCheck {
  BallZone zone;
  double mean_abs_error_deg = 0.0;
  std::array<double, 2> mean_error{};  ///< of the slopes along x and y
  std::optional<double> radius_mm;     ///< of the reconstructed ball; nothing when no sphere fits
};

struct DiameterCheck {
  double diameter_mm = 0.0;
  std::size_t presses = 0;
  double median_radius_mm = 0.0;
  double radius_error() const { return median_radius_mm / (0.5 * diameter_mm) - 1.0; }
};

enum class Verdict { good, usable, recalibrate };
const char* verdict_name(Verdict verdict);

/// How a model reads presses of known balls.
struct ModelCheck {
  SlopeStatistics slopes;
  std::vector<PressCheck> presses;
  std::vector<DiameterCheck> diameters;  ///< in growing order
  Verdict verdict = Verdict::recalibrate;
  std::vector<std::string> reasons;  ///< for people: what is not good, worst first; empty when all is

  /// A reason to recalibrate that lies in the presses; "" is none.
  void add_warning(const std::string& warning) {
    if (warning.empty()) return;
    verdict = Verdict::recalibrate;
    reasons.insert(reasons.begin(), warning);
  }
};

/// Reads every zone, reconstructs every ball (in the light as it is) and judges. Of several models each reads
/// the zones in turn. `progress`, if given, is called with the number of presses done. Throws Error without
/// zones, or when a model does not fit.
ModelCheck check_model(std::span<const GradientModel> models, const PressSet& set,
                       const std::vector<BallZone>& zones, double pixel_pitch_mm,
                       const std::function<void(std::size_t)>& progress = nullptr);

}  // namespace gelslam
