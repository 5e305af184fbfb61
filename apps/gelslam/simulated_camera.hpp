#pragma once

#include <filesystem>

#include "camera_input.hpp"

namespace gelslam {

/// A sensor and a hand to try the program with: a pebble, rolled all over.

inline const char* simulated_camera_name() { return "simulated"; }

/// Frames at 25 Hz, drawn when they are asked for.
CameraInput open_simulated_camera(const Config& config);

/// Its gradient model, as a file in the user's cache folder. Throws Error.
std::filesystem::path simulated_camera_model();

}  // namespace gelslam
