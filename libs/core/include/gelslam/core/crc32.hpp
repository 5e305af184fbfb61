#pragma once

#include <zlib.h>

#include <cstdint>
#include <string_view>

namespace gelslam {

/// The CRC-32 of zlib and PNG; `before` is the checksum of the preceding bytes. A target that includes this
/// header must link ZLIB.
inline std::uint32_t crc32_of(std::string_view bytes, std::uint32_t before = 0) {
  return static_cast<std::uint32_t>(
      ::crc32_z(before, reinterpret_cast<const Bytef*>(bytes.data()), bytes.size()));
}

}  // namespace gelslam
