#pragma once

#include <filesystem>
#include <functional>
#include <memory>
#include <string>

namespace gelslam::viewer {

class WindowHost;

/// Options of all windows.
struct WindowLoopOptions {
  std::string title = "GelSLAM";
  int width_px = 1280, height_px = 800;        ///< Size of the content, in screen coordinates.
  bool visible = true;                         ///< False: drawn without a display, for tests and images.
  std::filesystem::path picture_folder = ".";  ///< Folder of screenshots.
  std::string picture_stem = "screenshot";
  /// PNG of the window's last state, written when it closes; empty: none.
  std::filesystem::path snapshot{};
  /// Returns true if the end is requested from elsewhere (Ctrl-C, log-out). May be empty.
  std::function<bool()> asks_to_end{};
  std::shared_ptr<WindowHost> host{};  ///< The window to be used, if it already exists.
  double poll_s = 0.1;                 ///< Interval at which an idle window looks for new data.
  double redraw_s = 1e9;               ///< An idle window is redrawn after this time.
  /// Other threads need the processor: after each frame it sleeps for as long as the frame took.
  bool yields = false;
};

/// Throws Error, with advice, when no window could be opened. Shows nothing.
void require_display();

/// With X11, Xlib ends the program when the display server is gone. `work` is then called first, in the
/// window's thread. Empty: nothing is called.
void before_display_loss_ends_it(std::function<void()> work);

}  // namespace gelslam::viewer
