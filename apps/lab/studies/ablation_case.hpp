#pragma once

#include <string>
#include <utility>
#include <vector>

#include "gelslam/evaluation/ground_truth.hpp"
#include "gelslam/slam/config.hpp"
#include "study.hpp"

namespace gelslam::lab {

/// The system with some keys of its configuration changed, usually to turn a mechanism off.
struct Variant {
  std::string name;
  std::vector<std::pair<std::string, std::string>> settings;  ///< Pairs of key and value.
};

/// Returns one variant for every mechanism that an option can turn off.
std::vector<Variant> mechanism_variants();

/// Parses "name: key=value, key=value". Throws Error.
Variant parse_variant(const std::string& text);

/// Applies the settings of a variant. A key that occurs in several sections is written as section.key. Throws
/// Error for an unknown or ambiguous key and for a value that the configuration refuses.
Config with_settings(const Config& config, const Variant& variant);

/// A log on which every variant is measured.
struct AblationCase {
  std::string set, sequence, model;  ///< Names in the tables.
  LogInput input;
  Config config;  ///< From resolve_config(input).
};

/// Returns one row per variant, with the same keys. Errors, including undetected ones, are null if the log
/// has no ground truth. Throws Error.
Json measure_case(const AblationCase& measured, const std::vector<Variant>& variants);

/// Compares each row of the study with that of the baseline for the same log and model. `error` is the error
/// without the mechanism over the error with it (below 1 the mechanism does harm); the other columns are
/// formed in the same way. `baseline` is the name of the variant with everything on.
Json ablation_ratios(const Json& rows, const std::string& baseline);

}  // namespace gelslam::lab
