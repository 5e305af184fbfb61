#pragma once

#include <string>
#include <vector>

#include "cameras/video_node.hpp"

namespace gelslam::detail {

/// True when anything in the camera follows the picture: exposure, white balance, gain, focus, rate.
bool has_automatics_on(const VideoNode& node);

struct ControlReport {
  std::vector<CameraSetting> settings;  ///< all that can be read
  std::string warning;                  ///< what stays automatic or could not be set, or ""
};

/// Turns the automatics off and writes back the values that they had found (a camera may otherwise fall back
/// to what was set by hand long ago), sets `wanted`, then reads everything. Throws Error for a wanted control
/// that the camera does not have, naming those it has, and for a value it refuses.
ControlReport hold_controls(const VideoNode& node,
                            const std::vector<std::pair<std::string, std::int64_t>>& wanted,
                            const std::vector<CameraSetting>& values_found);

/// Values of everything that can be read now.
std::vector<CameraSetting> read_controls(const VideoNode& node);

}  // namespace gelslam::detail
