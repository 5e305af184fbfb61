#include "cameras/video_node.hpp"

#include <fcntl.h>
#include <linux/videodev2.h>

#include <algorithm>
#include <cerrno>
#include <system_error>

#include "gelslam/core/text.hpp"

namespace gelslam::detail {
namespace {

std::string permission_words(const std::string& group) {
  if (group.empty()) return "permission denied; check who may read and write it";
  return "permission denied; the camera belongs to the group " + group + ": sudo usermod -aG " + group +
         " $USER, then log out and in again";
}

std::string busy_words(const std::string& holder) {
  if (holder.empty()) return "another program uses the camera; close it first";
  return holder + " uses the camera; close that program first";
}

std::string words_of(const VideoSystem& system, const std::string& path, const std::string& doing, int code) {
  if (code == ENOENT) return "there is no such device; see gelslam devices";
  if (code == EACCES || code == EPERM) return permission_words(system.group(path));
  if (code == EBUSY) return busy_words(system.held_by(path));
  if (code == ENODEV || code == ENXIO) return "the camera is gone; is it unplugged?";
  if (code == ENOSPC)
    return "not enough USB bandwidth; connect the camera to another port, away from other cameras";
  if (code == EIO || code == EPROTO || code == ETIMEDOUT)
    return "the camera does not answer; unplug it and plug it in again";
  return "cannot " + doing + ": " + std::generic_category().message(code);
}

}  // namespace

std::string driver_text(std::span<const std::uint8_t> bytes) {
  const auto end = std::find(bytes.begin(), bytes.end(), std::uint8_t{0});
  return one_line(std::string(bytes.begin(), end));
}

CameraFailure camera_failure(const VideoSystem& system, const std::string& path, const std::string& doing,
                             int code) {
  return CameraFailure(path + ": " + words_of(system, path, doing, code), code);
}

CameraNode NodeIdentity::kind() const {
  if ((capabilities & V4L2_CAP_VIDEO_CAPTURE) != 0) return CameraNode::capture;
  return (capabilities & V4L2_CAP_META_CAPTURE) != 0 ? CameraNode::metadata : CameraNode::other;
}

VideoNode::VideoNode(const VideoSystem& system, std::string path)
    : system_(system),
      path_(std::move(path)),
      fd_(system.open(path_.c_str(), O_RDWR | O_NONBLOCK | O_CLOEXEC)) {
  if (fd_ < 0) throw camera_failure(system_, path_, "open it", errno);
}

VideoNode::~VideoNode() { system_.close(fd_); }

int VideoNode::call(unsigned long request, void* argument) const {
  for (;;) {
    if (system_.ioctl(fd_, request, argument) >= 0) return 0;
    if (errno != EINTR) return errno;
  }
}

void VideoNode::require(unsigned long request, void* argument, const std::string& doing) const {
  if (const int code = call(request, argument); code != 0) throw camera_failure(system_, path_, doing, code);
}

NodeIdentity VideoNode::identity() const {
  v4l2_capability capability{};
  if (const int code = call(VIDIOC_QUERYCAP, &capability); code != 0) {
    if (code == ENOTTY || code == EINVAL) throw CameraFailure(path_ + ": not a camera", code);
    throw camera_failure(system_, path_, "ask what it is", code);
  }
  NodeIdentity identity;
  identity.name = driver_text(capability.card);
  identity.driver = driver_text(capability.driver);
  identity.bus = driver_text(capability.bus_info);
  const bool own = (capability.capabilities & V4L2_CAP_DEVICE_CAPS) != 0;
  identity.capabilities = own ? capability.device_caps : capability.capabilities;
  return identity;
}

}  // namespace gelslam::detail
