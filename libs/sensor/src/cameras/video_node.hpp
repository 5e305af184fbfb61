#pragma once

#include <poll.h>
#include <sys/types.h>

#include <cstdint>
#include <functional>
#include <span>
#include <string>
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

/// The sentence for a failed call: what is wrong with the node and what to do. `doing`: "set the format".
CameraFailure camera_failure(const VideoSystem& system, const std::string& path, const std::string& doing,
                             int code);

/// What VIDIOC_QUERYCAP says.
struct NodeIdentity {
  std::string name, driver, bus;
  std::uint32_t capabilities = 0;  ///< of this node, not of the whole device
  CameraNode kind() const;
};

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
  NodeIdentity identity() const;

  const VideoSystem& system() const { return system_; }
  const std::string& path() const { return path_; }
  int fd() const { return fd_; }

 private:
  const VideoSystem& system_;
  std::string path_;
  int fd_;
};

}  // namespace gelslam::detail
