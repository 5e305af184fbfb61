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

/// The system calls that a camera is used through, with errno as they leave it; tests put a driver of their
/// own here.
struct VideoSystem {
  std::function<int(const char* path, int flags)> open;
  std::function<int(int fd)> close;
  std::function<int(int fd, unsigned long request, void* argument)> ioctl;
  std::function<void*(std::size_t length, int fd, off_t offset)> map;  ///< MAP_FAILED when it fails
  std::function<int(void* address, std::size_t length)> unmap;
  std::function<int(pollfd* fds, nfds_t count, int timeout_ms)> poll;
  std::function<std::chrono::steady_clock::time_point()> now;  ///< by which frames arrive

  std::function<std::int64_t()> unix_offset_us;     ///< Unix time less the monotonic clock's, now
  std::function<std::vector<std::string>()> nodes;  ///< all /dev/video*, in the order of their numbers
  std::function<std::string(const std::string& path)> group;  ///< that owns the node, or ""
  std::function<std::string(const std::string& path)>
      held_by;  ///< "ffmpeg (pid 123)" or "", but not this program
};

/// Those of Linux.
const VideoSystem& linux_video_system();

/// A failed system call on a camera, in words; `code` is its errno.
class CameraFailure : public Error {
 public:
  CameraFailure(const std::string& words, int errno_code) : Error(words), code(errno_code) {}
  int code;
};

/// A driver's text of fixed length, up to its first zero byte, on one line.
std::string driver_text(std::span<const std::uint8_t> bytes);

/// An open /dev/video node.
class VideoNode {
 public:
  /// Throws CameraFailure.
  VideoNode(const VideoSystem& system, std::string path);
  ~VideoNode();
  VideoNode(const VideoNode&) = delete;
  VideoNode& operator=(const VideoNode&) = delete;

  /// 0, or the errno; interrupted calls are made again.
  int call(unsigned long request, void* argument) const;
  /// Throws CameraFailure instead.
  void require(unsigned long request, void* argument, const std::string& doing) const;
  /// The sentence for a failed call: what is wrong with the node and what to do. `doing`: "set the format".
  CameraFailure failure(const std::string& doing, int code) const;
  /// What VIDIOC_QUERYCAP says: names and kind.
  CameraInfo identity() const;

  const VideoSystem& system() const { return system_; }
  const std::string& path() const { return path_; }
  int fd() const { return fd_; }

 private:
  const VideoSystem& system_;
  std::string path_;
  int fd_;
};

/// "GelSight Mini" or "DIGIT" when the name says so, else "".
std::string known_sensor(const std::string& name);

/// The node that the options mean. Throws Error, with what there is, when there is none or more than one.
std::string find_camera(const CameraOptions& options, const VideoSystem& system);

/// The nodes of cameras with this name.
std::vector<std::string> nodes_named(const std::string& name, const VideoSystem& system);

/// The node of a camera that was away: one of its name that is where it was, or none of `others`, which have
/// its name and were there without it. Throws Error when there is none.
std::string find_again(const CameraInfo& camera, const std::vector<std::string>& others,
                       const VideoSystem& system);

/// The node with the pictures of the camera whose node with metadata is `path`, or "".
std::string capture_node_beside(const std::string& path, const std::string& bus, const VideoSystem& system);

/// Every format, size and rate that the node says it has; bounded, whatever it says.
std::vector<CameraMode> camera_modes(const VideoNode& node);

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
