#pragma once

#include <string>
#include <utility>
#include <vector>

#include "gelslam/evaluation/ground_truth.hpp"
#include "gelslam/slam/config.hpp"
#include "study.hpp"

namespace gelslam::lab {

/// The chain with some keys of its configuration set, mostly so that a mechanism is off.
struct Variant {
  std::string name;
  std::vector<std::pair<std::string, std::string>> settings;  ///< key, value
};

/// One for every mechanism that an option switches off.
std::vector<Variant> mechanism_variants();

/// Reads "name: key=value, key=value". Throws Error.
Variant parse_variant(const std::string& text);

/// A key that occurs in several sections is written section.key. Throws Error on an unknown or ambiguous key
/// and on a value that the configuration refuses.
Config with_settings(const Config& config, const Variant& variant);

/// A log that every variant is measured on.
struct AblationCase {
  std::string set, sequence, model;  ///< as the tables name them
  LogInput input;
  Config config;  ///< of resolve_config(input)
};

/// One row per variant, with the same keys. Errors, undetected ones too, are null where the log has no truth.
/// Throws Error.
Json measure_case(const AblationCase& measured, const std::vector<Variant>& variants);

/// Each row of the study beside the first of the same log and model: what the variant does without is
/// worth `error` (error without it over error with it; below 1 it harms), and so on. `baseline` is the name
/// of the variant with everything on.
Json ablation_ratios(const Json& rows, const std::string& baseline);

}  // namespace gelslam::lab
