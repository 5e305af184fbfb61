#pragma once

#include <memory>

#include "cameras/video_system.hpp"
#include "gelslam/sensor/camera.hpp"

namespace gelslam::detail {

/// open_camera() on the given system calls, which must outlive the camera.
std::unique_ptr<CameraSource> open_camera(const CameraOptions& options, const VideoSystem& system);

}  // namespace gelslam::detail
