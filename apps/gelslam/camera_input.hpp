#pragma once

#include <memory>
#include <string>

#include "gelslam/sensor/camera.hpp"
#include "gelslam/sensor/log_writer.hpp"
#include "gelslam/slam/config.hpp"

namespace gelslam {

/// A camera that streams, and what a log of it should hold beside its frames.
struct CameraInput {
  std::unique_ptr<RawFrameSource> frames;
  LogAttachments attachments;
};

/// The camera that the configuration names, or `device` if that is not empty. Throws Error like
/// open_camera(), and when Ctrl-C was pressed meanwhile.
CameraInput open_camera_input(const Config& config, const std::string& device);

/// For what a person did not name: "gelslam-20261120-083000", local time.
std::string name_by_time();

}  // namespace gelslam
