#pragma once

#include <filesystem>
#include <functional>
#include <optional>
#include <string>

#include "gelslam/slam/live_session.hpp"

namespace gelslam {

struct WindowOptions {
  std::string title = "GelSLAM";
  /// Where screenshots and exports go, and what the finished window points at; made when it is first needed.
  std::filesystem::path output_folder = ".";
  bool keeps_run = true;  ///< false: there is no run folder; output_folder only takes pictures and exports
  /// Keys and movements instead of a person's (docs/viewer.md has the format); empty: none. Text, not a
  /// file's name.
  std::string script;
  std::string script_name = "script";  ///< as errors call it
  /// Whether somebody ended the scan from elsewhere (Ctrl-C, log-out): then the window closes by itself once
  /// the scan is finished. Empty: never.
  std::function<bool()> asks_to_end;
  int width_px = 1280, height_px = 800;
  bool visible = true;             ///< false: drawn off-screen without a display, for tests and pictures
  std::filesystem::path snapshot;  ///< PNG of the window as it was last, written when it closes; empty: none
};

/// Shows a live scan until the person (or the script) closes the window; to be called on the main thread.
/// Drawing never blocks the session: at most 60 pictures a second, hardly any when nothing changes. Closing
/// asks, and then stops the session; but whoever calls must be ready for a window that closes while the
/// session is still scanning (script `quit`) or finishing. Returns 0. Throws Error when there is no display,
/// when the script is wrong (line and word) or waits in vain, and when the snapshot cannot be written.
int run_live_window(LiveSession& session, const WindowOptions& options);

/// The window as it would look now (map, touch, figures, words), drawn without a display and written as PNG:
/// what
/// `--headless --snapshot` leaves behind. Takes the session's mesh changes: not while a window is open.
/// Throws Error when it cannot be drawn or written.
void write_live_snapshot(LiveSession& session, const std::filesystem::path& png,
                         const WindowOptions& options = {});

/// Throws Error when `text` is no window script, naming line and word: before a camera is opened.
void check_window_script(const std::string& text, const std::string& name);

}  // namespace gelslam
