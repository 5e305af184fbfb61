#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "ui/key_binding.hpp"

namespace gelslam::viewer::detail {

/// Everything a person can ask of the window of a scan.
enum class WindowAction {
  pause,
  new_scan,
  undo_trial,
  save,
  screenshot,
  export_mesh,
  shading_lit,
  shading_matcap,
  shading_curvature,
  next_color,
  pose_graph,
  trajectory,
  follow,
  reset_view,
  grid,
  panels,
  help,
  stop,
};

/// In the order of the help overlay.
const std::vector<KeyBinding<WindowAction>>& window_keys();

/// "space", "a", "7", "f1", "esc", "enter", "left": the GLFW code of a key as a script writes it; nothing for
/// other words. Upper and lower case are the same.
std::optional<int> key_of_name(std::string_view name);
/// All names that key_of_name() knows, for "did you mean".
std::vector<std::string> key_names();

}  // namespace gelslam::viewer::detail
