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

/// What is asked of a camera.
struct CameraOptions {
  std::string device = "auto";  ///< "/dev/video2", "2", part of the camera's name, or "auto"
  /// which sensor "auto" looks for, and a warning when it is another one
  std::string sensor = "GelSight Mini";
  FrameEncoding encoding = FrameEncoding::jpeg;  ///< jpeg (MJPG) or yuyv
  int width_px = 3280, height_px = 2464;
  double rate_hz = 25;
  std::vector<std::pair<std::string, std::int64_t>> controls;  ///< set after the automatics are off
  double timeout_s = 5;  ///< a camera without a frame for this long has stalled
  /// how long automatic exposure runs before it is locked; skipped where nothing is automatic
  double settle_s = 1;
  double patience_s = 1;  ///< how long opening a busy or unready camera is tried again
  /// How long a camera that was lost while it streamed is waited for; next() then goes on with it.
  double reconnect_timeout_s = 0;
  /// Asked about ten times a second while the camera is being opened; true: give up. Empty: never.
  std::function<bool()> gives_up;
};

/// From device_config: `camera`, `camera_format`, `camera_controls`, the raw size and the rate. Throws Error
/// on a format that is neither MJPG nor YUYV, and on controls that are not "name=number, name=number".
CameraOptions camera_options(const SensorProfile& profile);

/// A control's value when the capture began, under the name that v4l2-ctl has for it. `locked`: the camera
/// does not change it by itself.
struct CameraSetting {
  std::string name;
  std::int64_t value = 0;
  bool locked = true;
};

/// A camera that streams. Frames that the driver marks as damaged, or that are empty, are not delivered and
/// count as lost; times are the driver's, or those of arrival where the driver has no monotonic ones.
class CameraSource : public RawFrameSource {
 public:
  virtual const std::vector<CameraSetting>& settings() const = 0;
};

/// Opens the camera, sets format, then rate, checks what was granted, holds exposure, white balance, gain and
/// focus where the driver allows it (an exposure that follows the touch ruins a photometric sensor), and
/// starts to stream. Throws Error, with a sentence for each: no camera, metadata node, busy (by whom), no
/// permission (which group), gone, another format than asked (and which there are), no bandwidth, given up.
/// warning() tells of what is not fatal. With `reconnect_timeout_s` a camera that is lost (cable, hub, power)
/// is looked for by its name, which has the serial number, and opened as it was; times, index and sequence go
/// on. `system` must outlive the camera.
std::unique_ptr<CameraSource> open_camera(const CameraOptions& options,
                                          const detail::VideoSystem& system = detail::linux_video_system());

/// Pictures that a camera offers. A camera with a range of sizes has the smallest here, too.
struct CameraMode {
  std::string format;  ///< "MJPG", "YUYV"
  int width_px = 0, height_px = 0;
  int smallest_width_px = 0, smallest_height_px = 0;  ///< equal to the above for a fixed size
  std::vector<double> rates_hz;                       ///< largest first; empty: the driver does not say
};

enum class CameraNode { capture, metadata, other, unknown };  ///< unknown: it cannot be opened

/// One /dev/video node.
struct CameraInfo {
  std::string path, name, driver, bus;
  CameraNode node = CameraNode::unknown;
  std::string sensor;     ///< the known sensor that its name says it is, or ""
  std::string in_use_by;  ///< "ffmpeg (pid 123)", as far as this user may see, or ""
  std::string problem;    ///< why it cannot be opened, with what to do, or ""
  std::vector<CameraMode> modes;
  std::vector<CameraSetting> settings;  ///< all controls that can be read, as they are now
};

/// All nodes, in the order of their numbers. Never throws for what a node does.
std::vector<CameraInfo> list_cameras(const detail::VideoSystem& system = detail::linux_video_system());

/// For people: "MJPG 3280x2464 at 25 Hz".
std::string mode_text(const CameraMode& mode);

}  // namespace gelslam
