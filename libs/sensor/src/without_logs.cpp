// In the place of logs/ where GELSLAM_BUILD_CAMERAS is off.
#include "gelslam/core/error.hpp"
#include "gelslam/sensor/raw_log.hpp"
#include "images/sources.hpp"

namespace gelslam {
namespace {

[[noreturn]] void refuse(const std::filesystem::path& log) {
  throw Error(log.string() +
              ": this build of GelSLAM reads videos and folders of images, but no Matroska logs "
              "(GELSLAM_BUILD_CAMERAS is off)");
}

}  // namespace

LogAttachments read_log_attachments(const std::filesystem::path& log) { refuse(log); }

std::unique_ptr<FrameSource> detail::open_matroska_frames(const std::filesystem::path& log,
                                                          const SensorProfile&) {
  refuse(log);
}

}  // namespace gelslam
