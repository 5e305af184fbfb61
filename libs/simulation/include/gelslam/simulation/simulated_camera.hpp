#pragma once

#include <memory>

#include "gelslam/sensor/raw_frame.hpp"

namespace gelslam {

/// Name to be given in place of a camera.
inline constexpr const char* kSimulatedCamera = "simulated";

/// A simulated GelSight Mini with a hand, to try programs: a pebble that is rolled on all sides for a minute.
/// 320x240 pixels at 25 Hz, rendered on demand. Its gradient model is mini_model_file().
std::unique_ptr<RawFrameSource> simulated_camera();

}  // namespace gelslam
