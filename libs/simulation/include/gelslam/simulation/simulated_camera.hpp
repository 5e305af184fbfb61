#pragma once

#include <memory>

#include "gelslam/sensor/raw_frame.hpp"

namespace gelslam {

/// The name under which it is asked for in the place of a camera.
inline constexpr const char* kSimulatedCamera = "simulated";

/// A GelSight Mini and a hand to try programs with: a pebble, rolled all over for a minute. 320x240, 25 Hz,
/// drawn when they are asked for. Its gradient model is mini_model_file().
std::unique_ptr<RawFrameSource> simulated_camera();

}  // namespace gelslam
