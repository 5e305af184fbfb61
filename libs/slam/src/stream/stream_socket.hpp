#pragma once

#include <string>

#include "gelslam/core/file_descriptor.hpp"

namespace gelslam::slam::detail {

/// A socket that accepts connections without blocking.
struct Listener {
  FileDescriptor socket;
  std::string name;       ///< "tcp:127.0.0.1:5555", "unix:/tmp/pose"
  std::string unix_path;  ///< to be removed at the end; or ""
};

/// `target`: "unix:PATH" or "tcp:PORT". A socket file that no program listens to any more is replaced.
/// Throws Error as StreamServer does.
Listener listen_at(const std::string& target);

}  // namespace gelslam::slam::detail
