#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>

#include "gelslam/core/stage_timer.hpp"
#include "gelslam/sensor/frame_source.hpp"
#include "gelslam/slam/log_input.hpp"
#include "gelslam/surface/surface.hpp"

namespace gelslam {

/// A log as a stream of surfaces: reads the background, then estimates frame by frame; never holds more than
/// the background frames at once.
class SurfaceStream {
 public:
  struct Item {
    std::int64_t frame = 0;
    double time_s = 0;
    SurfacePtr surface;  ///< null for background frames
  };

  /// Reads the background. Throws Error when the log is no log, is shorter than its background, or shows
  /// contact in it.
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
