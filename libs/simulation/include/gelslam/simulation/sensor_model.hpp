#pragma once

#include <string_view>

namespace gelslam {

/// Model files (docs/file-formats.md) of the simulated sensor, with a GelSight Mini's optics and with none.
/// scripts/simulated_models.sh makes them: `gelslam calibrate train` on presses of `gelslam simulate
/// presses`.
std::string_view mini_model_file();
std::string_view flat_model_file();

}  // namespace gelslam
