#pragma once

#include <string>
#include <utility>

namespace gelslam::slam::detail {

/// Closes its file when it goes. -1: none.
class FileDescriptor {
 public:
  explicit FileDescriptor(int fd = -1) : fd_(fd) {}
  ~FileDescriptor();
  FileDescriptor(FileDescriptor&& other) noexcept : fd_(std::exchange(other.fd_, -1)) {}
  FileDescriptor& operator=(FileDescriptor&& other) noexcept {
    std::swap(fd_, other.fd_);
    return *this;
  }
  int get() const { return fd_; }

 private:
  int fd_;
};

/// A socket that accepts connections without blocking.
struct Listener {
  FileDescriptor socket;
  std::string name;       ///< "tcp:127.0.0.1:5555", "unix:/tmp/pose"
  std::string unix_path;  ///< to be removed at the end; or ""
};

/// `target`: "unix:PATH" or "tcp:PORT". A socket file that no program listens to any more is replaced.
/// Throws Error as StreamServer does.
Listener listen_at(const std::string& target, const std::string& address);

}  // namespace gelslam::slam::detail
