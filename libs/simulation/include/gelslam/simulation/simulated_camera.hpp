#pragma once

#include <memory>

#include "gelslam/sensor/raw_frame.hpp"

namespace gelslam {

/// The name that programs and configurations give instead of that of a camera.
inline constexpr const char* kSimulatedCamera = "simulated";

/// Returns a simulated GelSight Mini, with which programs can be tried without a sensor. A hand rolls a
/// pebble on all sides over its gel for a minute. The pictures have 320x240 pixels at 25 Hz and are rendered
/// when they are read. The gradient model that fits them is mini_model_file().
std::unique_ptr<RawFrameSource> simulated_camera();

}  // namespace gelslam
