#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "gelslam/sensor/raw_frame.hpp"
#include "gelslam/sensor/sensor_profile.hpp"

namespace gelslam {

namespace detail {
struct VideoSystem;
const VideoSystem& linux_video_system();
}  // namespace detail

/// Requested properties of a camera.
struct CameraOptions {
  std::string device = "auto";  ///< "/dev/video2", "2", part of the camera's name, or "auto"
  /// Sensor that "auto" looks for. A warning is given if the camera is another one.
  std::string sensor = "GelSight Mini";
  FrameEncoding encoding = FrameEncoding::jpeg;  ///< jpeg (MJPG) or yuyv
  int width_px = 3280, height_px = 2464;
  double rate_hz = 25;
  /// Set after automatic controls were turned off.
  std::vector<std::pair<std::string, std::int64_t>> controls;
  double timeout_s = 5;  ///< A camera that delivers no frame for this long has stalled.
  /// Time for which automatic exposure runs before it is locked; skipped if nothing is automatic.
  double settle_s = 1;
  double patience_s = 1;  ///< Time for which opening a busy or unready camera is repeated.
  /// How long to wait for a camera that was lost while it streamed; next() then continues with it.
  double reconnect_timeout_s = 0;
  /// Called about ten times a second while the camera is being opened. If it returns true, opening is given
  /// up. May be empty.
  std::function<bool()> gives_up;
};

/// Returns the options from device_config: `camera`, `camera_format`, `camera_controls`, the raw size and the
/// rate. Throws Error for a format other than MJPG or YUYV, and for controls that are not "name=number,
/// name=number".
CameraOptions camera_options(const SensorProfile& profile);

/// Value of a control at the beginning of the capture, with its name as in v4l2-ctl. `locked`: the camera
/// does not change it automatically.
struct CameraSetting {
  std::string name;
  std::int64_t value = 0;
  bool locked = true;
};

/// A streaming camera. Frames that the driver marks as damaged, or that are empty, are not delivered and
/// count as lost. Times are those of the driver, or arrival times if the driver has no monotonic ones.
class CameraSource : public RawFrameSource {
 public:
  virtual const std::vector<CameraSetting>& settings() const = 0;
};

/// Opens a camera: sets format and rate, checks what the driver granted, locks exposure, white balance, gain
/// and focus if the driver allows it (an exposure that adapts to the contact makes photometric measurements
/// impossible), and starts streaming. Throws Error with a sentence for each cause: no camera, a metadata
/// node, busy (and by which program), no permission (and which group is needed), disconnected, another format
/// than requested (and which ones exist), not enough bandwidth, given up. Other problems are in warning().
/// With `reconnect_timeout_s`, a lost camera (cable, hub, power) is searched for by its name, which contains
/// the serial number, and opened again in the same way; times, index and sequence continue. `system` must
/// outlive the camera.
std::unique_ptr<CameraSource> open_camera(const CameraOptions& options,
                                          const detail::VideoSystem& system = detail::linux_video_system());

/// Image formats that a camera offers. For a range of sizes, the smallest one is given, too.
struct CameraMode {
  std::string format;  ///< "MJPG", "YUYV"
  int width_px = 0, height_px = 0;
  int smallest_width_px = 0, smallest_height_px = 0;  ///< Equal to the size above for a fixed size.
  std::vector<double> rates_hz;                       ///< Largest first; empty if the driver does not say.
};

enum class CameraNode { capture, metadata, other, unknown };  ///< unknown: it cannot be opened.

/// One /dev/video node.
struct CameraInfo {
  std::string path, name, driver, bus;
  CameraNode node = CameraNode::unknown;
  std::string sensor;     ///< Known sensor according to its name, or "".
  std::string in_use_by;  ///< "ffmpeg (pid 123)", as far as this user may see it, or "".
  std::string problem;    ///< Why it cannot be opened, with advice, or "".
  std::vector<CameraMode> modes;
  std::vector<CameraSetting> settings;  ///< Current values of all controls that can be read.
};

/// Returns all video nodes in the order of their numbers. Problems of single nodes do not cause exceptions.
std::vector<CameraInfo> list_cameras(const detail::VideoSystem& system = detail::linux_video_system());

/// Returns a description for the user: "MJPG 3280x2464 at 25 Hz".
std::string mode_text(const CameraMode& mode);

}  // namespace gelslam
