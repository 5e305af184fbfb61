#pragma once

#include <filesystem>
#include <memory>

#include "gelslam/sensor/frame_source.hpp"

namespace gelslam::detail {

/// A video file through OpenCV's FFmpeg backend. Times are the container's where they increase, else index /
/// rate.
std::unique_ptr<FrameSource> open_video(const std::filesystem::path& path, const SensorProfile& profile);

}  // namespace gelslam::detail
