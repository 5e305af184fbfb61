#pragma once

#include <atomic>
#include <filesystem>
#include <memory>
#include <string>

#include "gelslam/mesh/mesh.hpp"
#include "gelslam/slam/frame_report.hpp"
#include "gelslam/viewer/window.hpp"

namespace gelslam {

/// The map in which a sensor is localized.
struct ShownMap {
  std::string name;             ///< For the user.
  Mesh mesh;                    ///< In the map's frame, mm.
  double gradient_scale = 1.0;  ///< Heights of touches are divided by it.
};

/// Passes frames of a Localizer from its thread to the window, so that neither waits for the other.
struct LocatedTouches {
  std::atomic<std::shared_ptr<const FrameReport>> newest;  ///< Null before the first frame.
  /// The newest frame with at least one hypothesis in the map.
  std::atomic<std::shared_ptr<const FrameReport>> placed;
  std::atomic<bool> have_ended = false;
};

/// Shows the map in gray and the touch at its pose, or a transparent touch at each of several possible poses
/// (docs/localization.md), until the user closes the window or options.asks_to_end returns true. Must be
/// called from the main thread. Throws Error when there is no display, or when the snapshot cannot be
/// written.
void run_map_window(const ShownMap& map, const LocatedTouches& touches, const WindowOptions& options);

/// Draws the window with the newest touch in the map without a display, and writes it as PNG. Throws Error.
void write_map_snapshot(const ShownMap& map, const LocatedTouches& touches, const std::filesystem::path& png);

}  // namespace gelslam
