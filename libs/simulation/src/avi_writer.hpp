#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <span>

#include "gelslam/core/files.hpp"

namespace gelslam::simulation::detail {

/// A video file (AVI) of pictures that are already encoded. cv::VideoWriter would halve the color resolution
/// of JPEG pictures, and color is what this sensor measures with.
class AviWriter {
 public:
  /// `lossless`: PNG pictures, else JPEG. Throws Error when the file cannot be made.
  AviWriter(const std::filesystem::path& path, bool lossless, int width, int height, double rate_hz);
  ~AviWriter();
  /// Throws Error on a full disk.
  void add(std::span<const std::uint8_t> picture);
  /// Writes the index and makes the file appear.
  void finish();

 private:
  struct Muxer;
  void check(int result) const;

  TemporaryFile file_;
  std::filesystem::path path_;
  std::unique_ptr<Muxer> muxer_;
  std::int64_t pictures_ = 0;
};

}  // namespace gelslam::simulation::detail
