#pragma once

#include <cstdint>
#include <opencv2/core/mat.hpp>
#include <span>
#include <string>

namespace gelslam::detail {

/// A PNG's first words, and whether it is all there.
struct PngInfo {
  std::int64_t width_px = 0, height_px = 0;
  std::string damage;  ///< "" when every chunk up to the end mark is whole, by its checksum
};

/// Reads nothing but headers and checksums. What it finds whole makes libpng neither fail nor write to
/// stderr, unless somebody built it to do so.
PngInfo check_png(std::span<const std::uint8_t> bytes);

/// Color, 8 bits; alpha is dropped. Empty for everything else.
cv::Mat3b decode_png(std::span<const std::uint8_t> bytes);

}  // namespace gelslam::detail
