#pragma once

#include <cstdint>
#include <optional>
#include <span>

namespace gelslam::detail {

struct ImageHeader {
  std::int64_t width_px = 0, height_px = 0;
  bool complete = true;  ///< false for a JPEG without its end: the decoder would fill the rest with gray
};

/// What a PNG, BMP or JPEG file says about itself, without decoding it: a few bytes may claim gigabytes.
/// Nothing for other formats and for headers that make no sense (the decoder refuses those).
std::optional<ImageHeader> peek_image_header(std::span<const unsigned char> file);

}  // namespace gelslam::detail
