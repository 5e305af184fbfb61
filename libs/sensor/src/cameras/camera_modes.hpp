#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "cameras/video_node.hpp"

namespace gelslam::detail {

/// "MJPG" of V4L2_PIX_FMT_MJPEG; characters that cannot be printed become '?'.
std::string fourcc_text(std::uint32_t fourcc);

/// Every format, size and rate that the node says it has; bounded, whatever it says.
std::vector<CameraMode> camera_modes(const VideoNode& node);

/// For people: "MJPG 3280x2464 at 25 Hz; YUYV 640x480 at 30, 15 Hz", or "no formats".
std::string modes_text(const std::vector<CameraMode>& modes);

}  // namespace gelslam::detail
