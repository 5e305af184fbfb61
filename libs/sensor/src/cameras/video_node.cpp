#include <fcntl.h>
#include <grp.h>
#include <linux/videodev2.h>
#include <sys/ioctl.h>
#include <sys/mman.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <filesystem>
#include <fstream>
#include <system_error>

#include "cameras/v4l2_camera.hpp"
#include "gelslam/core/text.hpp"

namespace gelslam::detail {
namespace {

namespace fs = std::filesystem;

bool all_digits(const std::string& text) {
  return !text.empty() && text.find_first_not_of("0123456789") == std::string::npos;
}

std::vector<std::string> video_nodes() {
  std::vector<std::string> nodes;
  std::error_code code;
  for (fs::directory_iterator entry("/dev", code), end; !code && entry != end; entry.increment(code)) {
    const std::string name = entry->path().filename().string();
    if (name.starts_with("video") && all_digits(name.substr(5))) nodes.push_back(entry->path().string());
  }
  std::sort(nodes.begin(), nodes.end(), natural_less);
  return nodes;
}

std::string group_of(const std::string& path) {
  struct stat status {};
  if (::stat(path.c_str(), &status) != 0) return "";
  struct group group {};
  struct group* found = nullptr;
  std::array<char, 16384> buffer{};
  if (::getgrgid_r(status.st_gid, &group, buffer.data(), buffer.size(), &found) != 0 || found == nullptr)
    return "";
  return found->gr_name;
}

bool holds(const fs::path& process, const fs::path& node) {
  std::error_code code;
  for (fs::directory_iterator entry(process / "fd", code), end; !code && entry != end;
       entry.increment(code)) {
    std::error_code gone;
    if (fs::read_symlink(entry->path(), gone) == node) return true;
  }
  return false;
}

std::string program_name(const fs::path& process) {
  std::string name;
  std::getline(std::ifstream(process / "comm") >> std::ws, name);
  return name.empty() ? "a program" : name;
}

std::string holder_of(const std::string& path) {
  std::error_code code;
  const fs::path node = fs::canonical(path, code);
  if (code) return "";
  const std::string ourselves = std::to_string(::getpid());
  for (fs::directory_iterator entry("/proc", code), end; !code && entry != end; entry.increment(code)) {
    const std::string pid = entry->path().filename().string();
    if (!all_digits(pid) || pid == ourselves || !holds(entry->path(), node)) continue;
    return program_name(entry->path()) + " (pid " + pid + ")";
  }
  return "";
}

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

const VideoSystem& linux_video_system() {
  static const VideoSystem system{
      [](const char* path, int flags) { return ::open(path, flags); },
      [](int fd) { return ::close(fd); },
      [](int fd, unsigned long request, void* argument) { return ::ioctl(fd, request, argument); },
      [](std::size_t length, int fd, off_t offset) {
        return ::mmap(nullptr, length, PROT_READ | PROT_WRITE, MAP_SHARED, fd, offset);
      },
      [](void* address, std::size_t length) { return ::munmap(address, length); },
      [](pollfd* fds, nfds_t count, int timeout_ms) { return ::poll(fds, count, timeout_ms); },
      std::chrono::steady_clock::now,
      [] { return unix_us_now() - microseconds_of(std::chrono::steady_clock::now().time_since_epoch()); },
      video_nodes,
      group_of,
      holder_of};
  return system;
}

std::string driver_text(std::span<const std::uint8_t> bytes) {
  const auto end = std::find(bytes.begin(), bytes.end(), std::uint8_t{0});
  return one_line(std::string(bytes.begin(), end));
}

VideoNode::VideoNode(const VideoSystem& system, std::string path)
    : system_(system),
      path_(std::move(path)),
      fd_(system.open(path_.c_str(), O_RDWR | O_NONBLOCK | O_CLOEXEC)) {
  if (fd_ < 0) throw failure("open it", errno);
}

VideoNode::~VideoNode() { system_.close(fd_); }

int VideoNode::call(unsigned long request, void* argument) const {
  for (;;) {
    if (system_.ioctl(fd_, request, argument) >= 0) return 0;
    if (errno != EINTR) return errno;
  }
}

void VideoNode::require(unsigned long request, void* argument, const std::string& doing) const {
  if (const int code = call(request, argument); code != 0) throw failure(doing, code);
}

CameraFailure VideoNode::failure(const std::string& doing, int code) const {
  return CameraFailure(path_ + ": " + words_of(system_, path_, doing, code), code);
}

CameraInfo VideoNode::identity() const {
  v4l2_capability capability{};
  if (const int code = call(VIDIOC_QUERYCAP, &capability); code != 0) {
    if (code == ENOTTY || code == EINVAL) throw CameraFailure(path_ + ": not a camera", code);
    throw failure("ask what it is", code);
  }
  CameraInfo identity;
  identity.path = path_;
  identity.name = driver_text(capability.card);
  identity.driver = driver_text(capability.driver);
  identity.bus = driver_text(capability.bus_info);
  const bool own = (capability.capabilities & V4L2_CAP_DEVICE_CAPS) != 0;
  const std::uint32_t capabilities = own ? capability.device_caps : capability.capabilities;
  identity.node = (capabilities & V4L2_CAP_VIDEO_CAPTURE) != 0  ? CameraNode::capture
                  : (capabilities & V4L2_CAP_META_CAPTURE) != 0 ? CameraNode::metadata
                                                                : CameraNode::other;
  return identity;
}

}  // namespace gelslam::detail
