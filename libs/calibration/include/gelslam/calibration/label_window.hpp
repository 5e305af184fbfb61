#pragma once

#include <cstddef>
#include <filesystem>

#include "gelslam/viewer/window_options.hpp"

namespace gelslam {

class LabelSession;

struct LabelWindowOptions : viewer::WindowLoopOptions {
  LabelWindowOptions() { title = "Labels - GelSLAM", picture_stem = "labels"; }
  double pixel_pitch_mm = 0.0634;
};

/// Shows press after press with its circle until the person ends it; then what was decided is saved without a
/// question. A disk that does not take it keeps the window open; the person may leave all the same.
/// options.asks_to_end is as if Q were pressed. Returns the number of presses written since it opened. Main
/// thread. Throws Error when there is no display, and when something stays unsaved at the end.
std::size_t run_label_window(LabelSession& session, const LabelWindowOptions& options);

/// The window as it opens, drawn without a display and written as PNG. Saves no label. Throws Error.
void write_label_snapshot(LabelSession& session, const std::filesystem::path& png,
                          const LabelWindowOptions& options);

}  // namespace gelslam
