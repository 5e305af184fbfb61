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
  std::array<double, 2> mean_error{};  ///< Mean error of the slopes along x and y.
  /// Radius of the reconstructed ball; nothing if no sphere can be fitted.
  std::optional<double> radius_mm;
};

struct DiameterCheck {
  double diameter_mm = 0.0;
  std::size_t presses = 0;
  double median_radius_mm = 0.0;
  double radius_error() const { return median_radius_mm / (0.5 * diameter_mm) - 1.0; }
};

enum class Verdict { good, usable, recalibrate };
const char* verdict_name(Verdict verdict);

/// Errors of a model on presses of balls of known diameter.
struct ModelCheck {
  SlopeStatistics slopes;
  std::vector<PressCheck> presses;
  std::vector<DiameterCheck> diameters;  ///< In ascending order.
  Verdict verdict = Verdict::recalibrate;
  /// Problems as sentences for the user, worst first; empty if there are none.
  std::vector<std::string> reasons;

  /// Adds a reason to recalibrate that was found in the presses; "" adds nothing.
  void add_warning(const std::string& warning) {
    if (warning.empty()) return;
    verdict = Verdict::recalibrate;
    reasons.insert(reasons.begin(), warning);
  }
};

/// Computes the slope errors in every zone and the radius of every reconstructed ball, without correction of
/// light, and judges the model. If several models are given, they read the zones in turn. `progress`, if
/// given, is called with the number of presses done. Throws Error without zones, or when a model does not
/// match the image size.
ModelCheck check_model(std::span<const GradientModel> models, const PressSet& set,
                       const std::vector<BallZone>& zones, double pixel_pitch_mm,
                       const std::function<void(std::size_t)>& progress = nullptr);

}  // namespace gelslam
