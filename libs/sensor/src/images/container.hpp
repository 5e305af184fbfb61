#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>

struct AVDictionary;
struct AVFormatContext;

namespace gelslam::detail {

/// Opens a file of libav's format `format` (null: of any). Null when it cannot be read; else for
/// avformat_close_input().
AVFormatContext* open_container(const std::filesystem::path& path, const char* format,
                                AVDictionary** options = nullptr);

/// As a whole number; nothing for what no file holds.
std::optional<std::int64_t> plausible_frames(double frames);

}  // namespace gelslam::detail
