#include <fcntl.h>
#include <grp.h>
#include <sys/ioctl.h>
#include <sys/mman.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <filesystem>
#include <fstream>

#include "cameras/video_node.hpp"
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
      [] { return unix_us_now() - microseconds_of(std::chrono::steady_clock::now().time_since_epoch()); },
      video_nodes,
      group_of,
      holder_of};
  return system;
}

}  // namespace gelslam::detail
