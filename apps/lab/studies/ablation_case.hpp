#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "ablation_variants.hpp"
#include "gelslam/evaluation/ground_truth.hpp"
#include "study.hpp"

namespace gelslam::lab {

/// A log that every variant is measured on.
struct AblationCase {
  std::string set, sequence, model;  ///< as the tables name them
  LogInput input;
  Config config;  ///< of resolve_config(input)
};

/// One row per variant, with the same keys. Errors and silent frames are null where the log has no truth.
/// Throws Error.
Json measure_case(const AblationCase& measured, const std::vector<Variant>& variants);

/// Each row of the study beside the first of the same log and model: what the variant does without is
/// worth `error` (error without it over error with it; below 1 it harms), and so on. `baseline` is the name
/// of the variant with everything on.
Json ablation_ratios(const Json& rows, const std::string& baseline);

}  // namespace gelslam::lab
