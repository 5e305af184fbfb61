#pragma once

#include <atomic>
#include <filesystem>
#include <memory>
#include <string>

#include "gelslam/mesh/mesh.hpp"
#include "gelslam/slam/frame_report.hpp"
#include "gelslam/viewer/window.hpp"

namespace gelslam {

/// The map that a sensor is located in.
struct ShownMap {
  std::string name;             ///< for people
  Mesh mesh;                    ///< in the map's frame, mm
  double gradient_scale = 1.0;  ///< heights of touches are divided by it
};

/// Hands frames of a Localizer from the thread that locates them to the window, so that neither waits for the
/// other.
struct LocatedTouches {
  std::atomic<std::shared_ptr<const FrameReport>> newest;  ///< null before the first
  std::atomic<std::shared_ptr<const FrameReport>> placed;  ///< the newest that may be somewhere in the map
  std::atomic<bool> have_ended = false;
};

/// Shows the map in gray and the touch at its place, or a transparent touch at each of several possible
/// places (docs/localization.md), until the person closes the window, or options.asks_to_end. Main thread.
/// Throws Error when there is no display, or the snapshot cannot be written.
void run_map_window(const ShownMap& map, const LocatedTouches& touches, const WindowOptions& options);

/// The window as it would look with the newest touch in the map, drawn without a display and written as PNG.
/// Throws Error.
void write_map_snapshot(const ShownMap& map, const LocatedTouches& touches, const std::filesystem::path& png);

}  // namespace gelslam
