#pragma once

#include <memory>

#include "gelslam/sensor/raw_frame.hpp"

namespace gelslam {

/// The name that selects the simulated camera in place of the name of a real one (--camera simulated).
inline constexpr const char* kSimulatedCamera = "simulated";

/// Returns a simulated GelSight Mini, with which programs can be tried without a sensor. It shows one second
/// of bare gel and then, for a minute, a pebble that a hand rolls on all sides, in 320x240 pixels at 25 Hz in
/// real time. Then the source ends. mini_model_file() is a gradient model for this camera.
std::unique_ptr<RawFrameSource> simulated_camera();

}  // namespace gelslam
