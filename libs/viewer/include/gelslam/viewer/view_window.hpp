#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "gelslam/viewer/scene_style.hpp"
#include "gelslam/viewer/view_content.hpp"
#include "gelslam/viewer/window_options.hpp"

namespace gelslam {

struct ViewWindowOptions : viewer::WindowLoopOptions {
  ViewWindowOptions() { picture_stem = "view", poll_s = 0.25; }
  SceneStyle style;                   ///< at first
  std::optional<double> time_s;       ///< at first; empty: the run as it was saved
  double yaw_deg = 0, pitch_deg = 0;  ///< how far the object is turned from the view of most of it
};

/// Looks at a run or mesh, alone or beside a second one, until the person closes the window: turning, time,
/// colors, pictures (docs/viewer.md). Main thread. Throws Error when there is no display or the script is
/// wrong.
void run_view_window(ViewContent first, std::optional<ViewContent> second, const ViewWindowOptions& options);

/// A run folder with a mesh, or a mesh file, and when it was last changed.
struct Viewable {
  std::filesystem::path path;
  std::filesystem::file_time_type changed;
};

/// What load_view() could open in a folder and up to four folders below it, the newest first. Leaves out what
/// is hidden or may not be read, and what lies within runs.
std::vector<Viewable> find_viewable(const std::filesystem::path& folder);

/// Lets a person choose one of find_viewable(), or drop another one on the window; nothing when they close
/// it. `complaint` is shown above the list, if it is not empty. Main thread. Throws Error when there is no
/// display.
std::optional<std::filesystem::path> run_choose_window(const std::filesystem::path& folder,
                                                       const std::string& complaint,
                                                       const viewer::WindowLoopOptions& options);

/// What the window would show first, without its buttons, drawn at full detail without a display and written
/// as PNG. Throws Error.
void write_view_snapshot(ViewContent first, std::optional<ViewContent> second,
                         const ViewWindowOptions& options, const std::filesystem::path& png);

}  // namespace gelslam
