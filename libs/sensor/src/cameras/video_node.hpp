#pragma once

#include <cstdint>
#include <span>
#include <string>

#include "cameras/video_system.hpp"
#include "gelslam/core/error.hpp"
#include "gelslam/sensor/camera.hpp"

namespace gelslam::detail {

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
