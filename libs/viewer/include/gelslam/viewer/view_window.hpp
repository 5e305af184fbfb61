#pragma once

#include <filesystem>
#include <optional>

#include "gelslam/viewer/scene_style.hpp"
#include "gelslam/viewer/view_content.hpp"
#include "gelslam/viewer/window_options.hpp"

namespace gelslam {

struct ViewWindowOptions : viewer::WindowLoopOptions {
  ViewWindowOptions() { picture_stem = "view", poll_s = 0.25; }
  SceneStyle style;              ///< at first
  std::optional<double> time_s;  ///< at first; empty: the end
};

/// Looks at a run or mesh, alone or beside a second one, until the person closes the window: turning, time,
/// colors, pictures (docs/viewer.md). Main thread. Throws Error when there is no display.
void run_view_window(ViewContent first, std::optional<ViewContent> second, const ViewWindowOptions& options);

/// What the window would show first, without its buttons, drawn at full detail without a display and written
/// as PNG. Throws Error.
void write_view_snapshot(ViewContent first, std::optional<ViewContent> second,
                         const ViewWindowOptions& options, const std::filesystem::path& png);

}  // namespace gelslam
