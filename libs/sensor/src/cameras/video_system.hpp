#pragma once

#include <poll.h>
#include <sys/types.h>

#include <functional>
#include <string>
#include <vector>

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

  std::function<std::vector<std::string>()> nodes;  ///< all /dev/video*, in the order of their numbers
  std::function<std::string(const std::string& path)> group;  ///< that owns the node, or ""
  std::function<std::string(const std::string& path)>
      held_by;  ///< "ffmpeg (pid 123)" or "", but not this program
};

/// Those of Linux.
const VideoSystem& linux_video_system();

}  // namespace gelslam::detail
