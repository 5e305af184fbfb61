#pragma once

#include <poll.h>
#include <sys/types.h>

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "gelslam/core/error.hpp"
#include "gelslam/sensor/camera.hpp"

namespace gelslam::detail {

/// The system calls through which a camera is used; they set errno as usual. Tests replace them by a
/// simulated driver.
struct VideoSystem {
  std::function<int(const char* path, int flags)> open;
  std::function<int(int fd)> close;
  std::function<int(int fd, unsigned long request, void* argument)> ioctl;
  std::function<void*(std::size_t length, int fd, off_t offset)> map;  ///< MAP_FAILED when it fails
  std::function<int(void* address, std::size_t length)> unmap;
  std::function<int(pollfd* fds, nfds_t count, int timeout_ms)> poll;
  std::function<std::chrono::steady_clock::time_point()> now;  ///< Clock of the frames' arrival.

  std::function<std::int64_t()> unix_offset_us;     ///< Current Unix time minus the monotonic clock.
  std::function<std::vector<std::string>()> nodes;  ///< all /dev/video*, in the order of their numbers
  std::function<std::string(const std::string& path)> group;  ///< Group that owns the node, or "".
  std::function<std::string(const std::string& path)>
      held_by;  ///< Program that uses the node: "ffmpeg (pid 123)" or "", never this program.
};

/// Returns the system calls of Linux.
const VideoSystem& linux_video_system();

/// A failed system call on a camera, in words; `code` is its errno.
class CameraFailure : public Error {
 public:
  CameraFailure(const std::string& words, int errno_code) : Error(words), code(errno_code) {}
  int code;
};

/// Returns a driver's text of fixed length, up to its first zero byte, as one line.
std::string driver_text(std::span<const std::uint8_t> bytes);

/// An open /dev/video node.
class VideoNode {
 public:
  /// Throws CameraFailure.
  VideoNode(const VideoSystem& system, std::string path);
  ~VideoNode();
  VideoNode(const VideoNode&) = delete;
  VideoNode& operator=(const VideoNode&) = delete;

  /// Returns 0 or errno; interrupted calls are repeated.
  int call(unsigned long request, void* argument) const;
  /// Throws CameraFailure if the call fails. `doing` describes it: "set the format".
  void require(unsigned long request, void* argument, const std::string& doing) const;
  /// Returns the failure of a call as a sentence that says what is wrong with the node and what to do.
  /// `doing`: "set the format".
  CameraFailure failure(const std::string& doing, int code) const;
  /// Returns the names and the kind according to VIDIOC_QUERYCAP.
  CameraInfo identity() const;

  const VideoSystem& system() const { return system_; }
  const std::string& path() const { return path_; }
  int fd() const { return fd_; }

 private:
  const VideoSystem& system_;
  std::string path_;
  int fd_;
};

/// Returns "GelSight Mini" or "DIGIT" if the name contains it, else "".
std::string known_sensor(const std::string& name);

/// Returns the node that the options specify. Throws Error with the available cameras when there is none or
/// more than one.
std::string find_camera(const CameraOptions& options, const VideoSystem& system);

/// Returns the nodes of cameras with this name.
std::vector<std::string> nodes_named(const std::string& name, const VideoSystem& system);

/// Returns the node of a camera that was disconnected: one with its name at its former bus position, or one
/// with its name that is not in `others`, which are those present while it was away. Throws Error when there
/// is none.
std::string find_again(const CameraInfo& camera, const std::vector<std::string>& others,
                       const VideoSystem& system);

/// Returns the node with the images of the camera whose metadata node is `path`, or "".
std::string capture_node_beside(const std::string& path, const std::string& bus, const VideoSystem& system);

/// Returns every format, size and rate that the node reports, up to a limit.
std::vector<CameraMode> camera_modes(const VideoNode& node);

/// Format that the driver granted.
struct CaptureFormat {
  std::size_t row_bytes = 0;  ///< Including the gap after each row; 0 for JPEG.
  double rate_hz = 0;         ///< The requested rate if the driver does not say.
  std::string warning;        ///< "asked for 25 Hz, the driver gives 15 Hz", or ""
};

/// Sets the format, then the rate (which a new format would reset). Throws Error when the driver silently
/// chose another format or size, with the requested, the granted and the available ones.
CaptureFormat negotiate_format(const VideoNode& node, const CameraOptions& options);

/// Says whether anything in the camera adapts to the image: exposure, white balance, gain, focus, rate.
bool has_automatics_on(const VideoNode& node);

struct ControlReport {
  std::vector<CameraSetting> settings;  ///< All settings that can be read.
  std::string warning;                  ///< Controls that remain automatic or could not be set, or "".
};

/// Turns automatic controls off and writes back the values that they had found (otherwise a camera may return
/// to old manual values), sets `wanted`, and then reads all controls. Throws Error for a wanted control that
/// the camera does not have, with those that it has, and for a value that it refuses.
ControlReport hold_controls(const VideoNode& node,
                            const std::vector<std::pair<std::string, std::int64_t>>& wanted,
                            const std::vector<CameraSetting>& values_found);

/// Returns the current values of all controls that can be read.
std::vector<CameraSetting> read_controls(const VideoNode& node);

}  // namespace gelslam::detail
