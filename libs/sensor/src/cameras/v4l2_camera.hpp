#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "cameras/video_node.hpp"
#include "gelslam/sensor/camera.hpp"

namespace gelslam::detail {

/// open_camera() on the given system calls, which must outlive the camera.
std::unique_ptr<CameraSource> open_camera(const CameraOptions& options, const VideoSystem& system);

/// "GelSight Mini" or "DIGIT" when the name says so, else "".
std::string known_sensor(const std::string& name);

std::vector<CameraInfo> list_cameras(const VideoSystem& system);

/// The node that the options mean. Throws Error, with what there is, when there is none or more than one.
std::string find_camera(const CameraOptions& options, const VideoSystem& system);

/// The nodes of cameras with this name.
std::vector<std::string> nodes_named(const std::string& name, const VideoSystem& system);

/// The node of a camera that was away: one of its name that is where it was, or none of `others`, which have
/// its name and were there without it. Throws Error when there is none.
std::string find_again(const NodeIdentity& camera, const std::vector<std::string>& others,
                       const VideoSystem& system);

/// The node with the pictures of the camera whose node with metadata is `path`, or "".
std::string capture_node_beside(const std::string& path, const std::string& bus, const VideoSystem& system);

/// "MJPG" of V4L2_PIX_FMT_MJPEG; characters that cannot be printed become '?'.
std::string fourcc_text(std::uint32_t fourcc);

/// Every format, size and rate that the node says it has; bounded, whatever it says.
std::vector<CameraMode> camera_modes(const VideoNode& node);

/// For people: "MJPG 3280x2464 at 25 Hz; YUYV 640x480 at 30, 15 Hz", or "no formats".
std::string modes_text(const std::vector<CameraMode>& modes);

/// What the driver agreed to.
struct CaptureFormat {
  std::size_t row_bytes = 0;  ///< with the gap after each row; 0 for JPEG
  double rate_hz = 0;         ///< as asked, where the driver does not say
  std::string warning;        ///< "asked for 25 Hz, the driver gives 15 Hz", or ""
};

/// Sets the format, then the rate (which a new format would reset). Throws Error when the driver quietly
/// chose another format or size, with what was asked, what was granted and what there is.
CaptureFormat negotiate_format(const VideoNode& node, const CameraOptions& options);

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
