#pragma once

#include <filesystem>
#include <functional>
#include <string>

#include "gelslam/slam/live_slam.hpp"
#include "gelslam/viewer/window_options.hpp"

namespace gelslam {

struct WindowOptions : viewer::WindowLoopOptions {
  WindowOptions() { poll_s = 1.0 / 60, redraw_s = 0.5, yields = true; }
  /// False if there is no run folder. If true, the finished window shows picture_folder, which is created
  /// when it is first needed.
  bool keeps_run = true;
  std::function<void()> when_shown;  ///< Called once after the first frame was drawn.
  std::string next_run_folder = {};  ///< Folder for another scan; empty if there is no camera for one.
};

/// Shows a live scan until the user closes the window, or until the scan is finished and either
/// options.asks_to_end returns true or a new scan is wanted. Must be called from the main thread. Drawing
/// never blocks the session: it draws at most 60 frames per second, and hardly any while nothing changes.
/// Closing asks for confirmation and then stops the session, which may still be finishing when the window is
/// gone. Returns whether the user wants another scan. Throws Error when there is no display, and when the
/// snapshot cannot be written.
bool run_live_window(LiveSession& session, const WindowOptions& options);

/// Draws the current window (map, touch, statistics, texts) without a display and writes it as PNG, for
/// `--headless --snapshot`. Throws Error when it cannot be drawn or written.
void write_live_snapshot(LiveSession& session, const std::filesystem::path& png,
                         const WindowOptions& options = {});

}  // namespace gelslam
