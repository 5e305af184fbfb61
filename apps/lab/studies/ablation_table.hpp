#pragma once

#include "study.hpp"

namespace gelslam::lab {

/// Each row of the study beside the first of the same log and model: what the variant does without is
/// worth `error` (error without it over error with it; below 1 it harms), and so on. `baseline` is the name
/// of the variant with everything on.
Json ablation_ratios(const Json& rows, const std::string& baseline);

/// The same summed up per variant, set and model; "all" is every set. Error: geometric mean of the ratios.
Json ablation_table(const Json& ratios);

}  // namespace gelslam::lab
