#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include "gelslam/registration/registrar.hpp"

namespace gelslam::lab {

/// Absolute errors of one setting, grouped as [sequence][reference] with the errors of all problems of that
/// reference. All settings get the same problems; a reference that was skipped for a slow setting is empty.
using GroupedErrors = std::vector<std::vector<std::vector<Vector6d>>>;

struct ParetoCandidate {
  double time_ms = 0;
  GroupedErrors errors;
};

/// Result of a setting in comparison with all others.
struct ParetoStanding {
  /// Geometric mean, over sequences, of the six mean absolute errors (1 degree = 0.087 mm).
  double error_mm = 0;
  double relative = 1;  ///< Relative to the base's error on the same problems; this value is compared.
  /// 5 % and 95 % quantiles of bootstrap draws over references.
  double relative_low = 1, relative_high = 1;
  /// True if no other setting is at least as good in time and error and better in one of them (by 2 % of time
  /// or 0.2 % of error).
  bool on_front = false;
};

/// Compares settings by time and error. A bootstrap draw uses the same references for all settings, so that
/// references that are difficult for all do not widen the confidence intervals. All problems of a reference
/// are drawn together, as they share its noise. `base` must have errors for every reference. Deterministic.
std::vector<ParetoStanding> pareto_standings(const std::vector<ParetoCandidate>& candidates,
                                             std::size_t base);

/// A point of the chart: a method with one setting changed from its default.
struct SpeedSetting {
  std::string method;
  std::string knob;   ///< Name of the changed option: "samples"; "default" for the default settings.
  std::string value;  ///< "500"
  Registrar registrar;
};

/// Returns every setting that trades speed for accuracy, for the given methods (normalflow, icp, fpfh,
/// filterreg).
std::vector<SpeedSetting> speed_settings(const std::vector<std::string>& methods);

}  // namespace gelslam::lab
