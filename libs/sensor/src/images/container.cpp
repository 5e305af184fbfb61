#include "images/container.hpp"

extern "C" {
#include <libavformat/avformat.h>
}

namespace gelslam::detail {

AVFormatContext* open_container(const std::filesystem::path& path, const char* format,
                                AVDictionary** options) {
  av_log_set_level(AV_LOG_QUIET);  // what is wrong with a file is said by our errors
  // With its protocol, so that no part of the name is taken for one.
  const std::string url = "file:" + std::filesystem::absolute(path).string();
  const AVInputFormat* only = format == nullptr ? nullptr : av_find_input_format(format);
  AVFormatContext* file = nullptr;  // stays null on failure
  avformat_open_input(&file, url.c_str(), only, options);
  return file;
}

std::optional<std::int64_t> plausible_frames(double frames) {
  constexpr double kMost = 1e9;  // a header may claim anything
  if (!(frames >= 1 && frames < kMost)) return std::nullopt;
  return static_cast<std::int64_t>(frames);
}

}  // namespace gelslam::detail
