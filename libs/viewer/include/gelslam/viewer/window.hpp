#pragma once

#include <filesystem>
#include <functional>
#include <string>

#include "gelslam/slam/live_slam.hpp"
#include "gelslam/viewer/window_options.hpp"

namespace gelslam {

struct WindowOptions : viewer::WindowLoopOptions {
  WindowOptions() { poll_s = 1.0 / 60, redraw_s = 0.5, yields = true; }
  /// False: there is no run folder. the finished window points at picture_folder; it is made when it is first
  /// needed.
  bool keeps_run = true;
  std::function<void()> when_shown;  ///< called once, after the first picture
  std::string next_run_folder = {};  ///< where another scan would go; empty: there is no camera for one
};

/// Shows a live scan until the person closes the window, or the scan is finished and options.asks_to_end or a
/// new one is wanted. Main thread. Drawing never blocks the session: at most 60 pictures a second, hardly any
/// when nothing changes. Closing asks, and then stops the session, which may still be finishing when the
/// window is gone. Returns whether the person wants another scan. Throws Error when there is no display, and
/// when the snapshot cannot be written.
bool run_live_window(LiveSession& session, const WindowOptions& options);

/// The window as it would look now (map, touch, figures, words), drawn without a display and written as PNG:
/// what `--headless --snapshot` leaves behind. Throws Error when it cannot be drawn or written.
void write_live_snapshot(LiveSession& session, const std::filesystem::path& png,
                         const WindowOptions& options = {});

}  // namespace gelslam
