#pragma once

#include <mutex>

namespace gelslam::detail {

/// Tells OpenCV and FFmpeg, once per process, not to write to stderr: what is wrong with a file is said by
/// our errors. A level that the person set in the environment is respected. Call before the first video is
/// opened.
void silence_video_libraries();

/// Sends file descriptor 2 to /dev/null while it lives. The image libraries under OpenCV print warnings that
/// cannot be turned off through it. Process-wide, so hold it only around the one call; instances exclude each
/// other.
class QuietStderr {
 public:
  QuietStderr();
  ~QuietStderr();
  QuietStderr(const QuietStderr&) = delete;
  QuietStderr& operator=(const QuietStderr&) = delete;

 private:
  std::unique_lock<std::mutex> lock_;
  int saved_ = -1;
};

}  // namespace gelslam::detail
