#pragma once

#include <memory>

#include "gelslam/sensor/raw_frame.hpp"

namespace gelslam {

/// Name to be given in place of a camera.
inline constexpr const char* kSimulatedCamera = "simulated";

/// A simulated GelSight Mini on which a hand rolls a pebble on all sides for a minute, to try programs.
/// 320x240 pixels at 25 Hz, rendered on demand. Its gradient model is mini_model_file().
std::unique_ptr<RawFrameSource> simulated_camera();

}  // namespace gelslam
