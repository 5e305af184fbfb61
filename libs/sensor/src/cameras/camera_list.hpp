#pragma once

#include <string>
#include <vector>

#include "cameras/video_system.hpp"
#include "gelslam/sensor/camera.hpp"

namespace gelslam::detail {

/// "GelSight Mini" or "DIGIT" when the name says so, else "".
std::string known_sensor(const std::string& name);

std::vector<CameraInfo> list_cameras(const VideoSystem& system);

/// The node that the options mean. Throws Error, with what there is, when there is none or more than one.
std::string find_camera(const CameraOptions& options, const VideoSystem& system);

/// The node with the pictures of the camera whose node with metadata is `path`, or "".
std::string capture_node_beside(const std::string& path, const std::string& bus, const VideoSystem& system);

}  // namespace gelslam::detail
