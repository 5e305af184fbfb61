#pragma once

#include <cstddef>
#include <filesystem>
#include <functional>
#include <string>

namespace gelslam {

class LabelSession;

struct LabelWindowOptions {
  std::string title = "Labels - GelSLAM";
  int width_px = 1280, height_px = 800;
  double pixel_pitch_mm = 0.0634;
  std::filesystem::path picture_folder = ".";  ///< where key P puts pictures
  std::string script;  ///< keys and movements instead of a person's (docs/viewer.md); empty: none
  std::string script_name = "script";
  std::function<bool()> asks_to_end;  ///< Ctrl-C: once true, as if Q were pressed. Empty: never
  bool visible = true;                ///< false: drawn without a display, for tests; a script must end it
};

/// Shows press after press with its circle until the person (or the script) ends it; then what was decided is
/// saved without a question. A disk that does not take it keeps the window open; the person may leave all the
/// same. Returns the number of presses written since it opened. Main thread. Throws Error when there is no
/// display, when the script is wrong, and when something stays unsaved at the end.
std::size_t run_label_window(LabelSession& session, const LabelWindowOptions& options);

/// The window as it opens, drawn without a display and written as PNG. Saves no label. Throws Error.
void write_label_snapshot(LabelSession& session, const std::filesystem::path& png,
                          const LabelWindowOptions& options);

}  // namespace gelslam
