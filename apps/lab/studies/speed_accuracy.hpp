#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include "gelslam/registration/registrar.hpp"

namespace gelslam::lab {

/// Absolute errors of one setting on problems that every setting is given, grouped: [sequence][reference]
/// holds those of the problems of one reference. Empty where a slow setting was spared that reference.
using GroupedErrors = std::vector<std::vector<std::vector<Vector6d>>>;

struct ParetoCandidate {
  double time_ms = 0;
  GroupedErrors errors;
};

/// Where a setting stands among all.
struct ParetoStanding {
  /// geometric mean, over sequences, of the six mean absolute errors (1 degree = 0.087 mm)
  double error_mm = 0;
  double relative = 1;  ///< to the base's error on the same problems; this is what is compared
  double relative_low = 1, relative_high = 1;  ///< 5 % and 95 % of bootstrap draws over references
  /// no other is at least as good in both and better in one (by 2 % of time, 0.2 % of error)
  bool on_front = false;
};

/// Compares by time and error. The same references are drawn for all, so that what is hard for all does not
/// count as doubt; a reference's problems are drawn together, as they share its noise. `base` must have
/// errors for every reference. Deterministic.
std::vector<ParetoStanding> pareto_standings(const std::vector<ParetoCandidate>& candidates,
                                             std::size_t base);

/// One point of the chart: a method with one setting away from its default.
struct SpeedSetting {
  std::string method;
  std::string knob;   ///< what is turned: "samples"; "default" for the settings everything else starts from
  std::string value;  ///< "500"
  Registrar registrar;
};

/// Every setting that trades speed for accuracy, of the given methods (normalflow, icp, fpfh, filterreg).
std::vector<SpeedSetting> speed_settings(const std::vector<std::string>& methods);

}  // namespace gelslam::lab
