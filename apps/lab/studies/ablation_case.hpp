#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "ablation_variants.hpp"
#include "gelslam/evaluation/run_and_truth.hpp"
#include "study.hpp"

namespace gelslam::lab {

/// A log that every variant is measured on.
struct AblationCase {
  std::string set, sequence, model;  ///< as the tables name them
  LogInput input;
  Config config;  ///< of resolve_config(input)
};

/// One row per variant, with the same keys. Surfaces are computed once for all variants that do not change
/// them, and each frame goes through all chains before the next one, so that no more than one surface and the
/// chains' keyframes are held. Errors and silent frames are null where the log has no truth. Throws Error.
Json measure_case(const AblationCase& measured, const std::vector<Variant>& variants);

}  // namespace gelslam::lab
