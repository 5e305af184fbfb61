#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "ablation_variants.hpp"
#include "gelslam/evaluation/run_and_truth.hpp"
#include "study.hpp"

namespace gelslam::lab {

/// What is left out of a log, so that the chain has to cope.
struct Stress {
  const char* name;
  /// Whether a frame stays; they are counted after the background.
  bool (*keeps)(std::int64_t frame, std::int64_t frames, double rate_hz);
};

/// none; thinned: every third frame; jump: 0.4 s are missing in the middle.
const std::vector<Stress>& stresses();

/// A log that every variant is measured on.
struct AblationCase {
  std::string set, sequence, model;  ///< as the tables name them
  LogInput input;
  Config config;  ///< of resolve_config(input)
  const Stress* stress = nullptr;
};

/// One row per variant, with the same keys. Surfaces are computed once for all variants that do not change
/// them, and each frame goes through all chains before the next one, so that no more than one surface and the
/// chains' keyframes are held. Errors and silent frames are null where the log has no truth. Throws Error.
Json measure_case(const AblationCase& measured, const std::vector<Variant>& variants);

}  // namespace gelslam::lab
