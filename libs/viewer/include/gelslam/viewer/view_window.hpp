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
  std::optional<double> time_s;       ///< at first; empty: the end
  double yaw_deg = 0, pitch_deg = 0;  ///< how far the object is turned from the view of most of it
};

/// What is to be shown after a window: nothing, what was dropped on it, or what the person will choose.
struct ViewEnd {
  bool chooses = false;
  std::filesystem::path dropped = {};  ///< empty: nothing
};

/// Looks at a run or mesh, alone or beside a second one, until the person closes the window: turning, time,
/// colors, pictures (docs/viewer.md). Main thread. Throws Error when there is no display or the script is
/// wrong.
ViewEnd run_view_window(ViewContent first, std::optional<ViewContent> second,
                        const ViewWindowOptions& options);

/// A run folder with a mesh, or a mesh file, and when it was last changed.
struct Viewable {
  std::filesystem::path path;
  std::filesystem::file_time_type changed;
};

/// What load_view() could open in a folder and up to four folders below it, the newest first. Leaves out what
/// is hidden or may not be read, and what lies within runs.
std::vector<Viewable> find_viewable(const std::filesystem::path& folder);

/// Recorded logs in the same folders, also within runs: *.mkv and gelsight.avi, the newest first.
std::vector<Viewable> find_logs(const std::filesystem::path& folder);

/// A list to choose from.
struct Choices {
  struct Choice {
    std::string name, detail;
    std::filesystem::path path;
  };
  std::string title, sentence;
  std::string complaint;  ///< shown above the list; empty: none
  std::vector<Choice> choices;
};
/// find_viewable() as a list.
Choices runs_and_meshes(const std::filesystem::path& folder);
/// find_logs() as a list, for a scan without a camera.
Choices logs_to_replay(const std::filesystem::path& folder);

/// Lets a person choose one, or drop a file on the window; nothing when they close it. Main thread. Throws
/// Error when there is no display.
std::optional<std::filesystem::path> run_choose_window(const Choices& choices,
                                                       const viewer::WindowLoopOptions& options);

/// What the window would show first, without its buttons, drawn at full detail without a display and written
/// as PNG. Throws Error.
void write_view_snapshot(ViewContent first, std::optional<ViewContent> second,
                         const ViewWindowOptions& options, const std::filesystem::path& png);

}  // namespace gelslam
