#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <span>
#include <vector>

#include "gelslam/core/atomic_file.hpp"

namespace gelslam::simulation::detail {

/// A video file of already encoded pictures (AVI 1.0: RIFF with idx1). Own, because cv::VideoWriter halves
/// the resolution of color in MJPG, and color is what this sensor measures with.
class AviWriter {
 public:
  /// `codec`: "MJPG" (JPEG pictures) or "MPNG" (PNG pictures). Throws Error when the file cannot be made.
  AviWriter(const std::filesystem::path& path, std::array<char, 4> codec, int width, int height,
            double rate_hz);
  /// Throws Error on a full disk or beyond 1 GB, where AVI 1.0 ends.
  void add(std::span<const std::uint8_t> picture);
  /// Writes the index and makes the file appear.
  void finish();

 private:
  void write(std::span<const std::uint8_t> bytes);
  void write_header();

  TemporaryFile file_;
  std::filesystem::path path_;
  std::ofstream stream_;
  std::array<char, 4> codec_;
  int width_, height_;
  double rate_hz_;
  std::vector<std::uint32_t> sizes_;
  std::uint64_t picture_bytes_ = 0;
  std::uint32_t largest_ = 0;
};

}  // namespace gelslam::simulation::detail
