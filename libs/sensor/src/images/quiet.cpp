#include "images/quiet.hpp"

#include <fcntl.h>
#include <unistd.h>

#include <cstdlib>
#include <opencv2/core/utils/logger.hpp>

namespace gelslam::detail {
namespace {

std::mutex& stderr_mutex() {
  static std::mutex mutex;
  return mutex;
}

}  // namespace

void silence_video_libraries() {
  static std::once_flag once;
  std::call_once(once, [] {
    constexpr int keep_existing = 0;
    ::setenv("OPENCV_FFMPEG_LOGLEVEL", "-8",
             keep_existing);  // AV_LOG_QUIET; OpenCV reads it when it loads FFmpeg
    // A frame cut off by the end of a truncated file must not reach us half gray.
    ::setenv("OPENCV_FFMPEG_CAPTURE_OPTIONS", "fflags;discardcorrupt", keep_existing);
    if (std::getenv("OPENCV_LOG_LEVEL") == nullptr) {
      cv::utils::logging::setLogLevel(cv::utils::logging::LOG_LEVEL_SILENT);
    }
  });
}

QuietStderr::QuietStderr() : lock_(stderr_mutex()) {
  const int null = ::open("/dev/null", O_WRONLY | O_CLOEXEC);
  if (null < 0) return;
  saved_ = ::fcntl(STDERR_FILENO, F_DUPFD_CLOEXEC, 3);
  if (saved_ >= 0) ::dup2(null, STDERR_FILENO);
  ::close(null);
}

QuietStderr::~QuietStderr() {
  if (saved_ < 0) return;
  ::dup2(saved_, STDERR_FILENO);
  ::close(saved_);
}

}  // namespace gelslam::detail
