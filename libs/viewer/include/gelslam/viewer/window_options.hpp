#pragma once

#include <filesystem>
#include <functional>
#include <memory>
#include <string>

namespace gelslam::viewer {

class WindowHost;

/// What all windows have in common.
struct WindowLoopOptions {
  std::string title = "GelSLAM";
  int width_px = 1280, height_px = 800;        ///< of the content, in screen coordinates
  bool visible = true;                         ///< false: drawn without a display, for tests and pictures
  std::filesystem::path picture_folder = ".";  ///< of screenshots
  std::string picture_stem = "screenshot";
  /// PNG of the window as it was last, written when it closes; empty: none.
  std::filesystem::path snapshot{};
  /// Whether somebody wants the end from elsewhere (Ctrl-C, log-out). Empty: never.
  std::function<bool()> asks_to_end{};
  std::shared_ptr<WindowHost> host{};  ///< the window that shows it, where it is there already
  double poll_s = 0.1;                 ///< how often an idle window looks for news
  double redraw_s = 1e9;               ///< an idle window is drawn again after this time
  bool yields = false;                 ///< other threads need the processor: sleeps as long as a frame took
};

/// Throws Error, with what to do instead, where no window could be opened. Shows nothing.
void require_display();

/// Where windows are X's, whose library ends the program when the server is gone: `work`, in the thread of
/// the window, comes before that. Empty: nothing does.
void before_display_loss_ends_it(std::function<void()> work);

}  // namespace gelslam::viewer
