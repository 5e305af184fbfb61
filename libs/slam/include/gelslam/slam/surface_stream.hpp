#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>

#include "gelslam/core/stage_timer.hpp"
#include "gelslam/sensor/frame_source.hpp"
#include "gelslam/slam/config.hpp"
#include "gelslam/surface/surface.hpp"

namespace gelslam {

/// What a person names on the command line.
struct LogInput {
  std::filesystem::path log;         ///< video, folder of images, or data folder of the public layout
  std::filesystem::path config;      ///< empty: config.yaml in or beside the log if there is one, else the defaults
  std::filesystem::path model;       ///< empty: the one the configuration names
  std::filesystem::path background;  ///< an image; empty: the log's first frames
  bool force = false;                ///< go on although the background frames seem to show contact
};

/// The configuration that `input` asks for, with its model's path made certain. Throws Error.
Config resolve_config(const LogInput& input);

/// A log as a stream of surfaces: reads the background, then estimates frame by frame; never holds more than the
/// background frames at once.
class SurfaceStream {
 public:
  struct Item {
    std::int64_t frame = 0;
    double time_s = 0;
    SurfacePtr surface;  ///< null for background frames
  };

  /// Reads the background. Throws Error when the log is no log, is shorter than its background, or shows contact in it.
  SurfaceStream(const LogInput& input, const Config& config, StageTimer& timer);
  ~SurfaceStream();

  /// Frames in order, background frames first; nothing at the end.
  std::optional<Item> next();
  std::optional<std::int64_t> frame_count() const;
  std::string description() const;
  /// What was not right with the log, for people, or "" (complete at the end).
  std::string warning() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace gelslam
