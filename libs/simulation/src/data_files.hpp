#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <span>
#include <string>

#include "gelslam/core/files.hpp"
#include "gelslam/simulation/gel.hpp"

struct AVFormatContext;
struct AVPacket;

namespace gelslam::simulation::detail {

/// Returns config.yaml of a data folder, with the same keys as the public configurations. `model` is the
/// gradient model to be named in it, or empty.
std::string config_yaml(const std::filesystem::path& folder, const SensorGeometry& geometry,
                        double frame_rate_hz, const std::filesystem::path& model);

/// Writes a video file (AVI) of JPEG images with full color resolution. cv::VideoWriter would halve the color
/// resolution, and this sensor measures by color.
class AviWriter {
 public:
  /// Throws Error when the file cannot be created.
  AviWriter(const std::filesystem::path& path, int width, int height, double rate_hz);
  /// Throws Error on a full disk.
  void add(std::span<const std::uint8_t> picture);
  /// Writes the index and moves the temporary file to its final name.
  void finish();

 private:
  void check(int result) const;

  TemporaryFile file_;
  std::filesystem::path path_;
  std::unique_ptr<AVFormatContext, void (*)(AVFormatContext*)> muxer_;
  std::unique_ptr<AVPacket, void (*)(AVPacket*)> packet_;
  const int millihertz_;
  std::int64_t pictures_ = 0;
};

}  // namespace gelslam::simulation::detail
