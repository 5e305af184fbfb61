#pragma once

#include <filesystem>
#include <opencv2/core/mat.hpp>
#include <optional>
#include <string>

#include "gelslam/calibration/press_coverage.hpp"
#include "gelslam/calibration/press_set.hpp"
#include "gelslam/viewer/window_options.hpp"

namespace gelslam {

/// What the window of `gelslam calibrate collect` shows, at one time.
struct CollectView {
  cv::Mat3b bgr;                        ///< the newest picture; empty at first
  std::optional<ContactCircle> circle;  ///< found in this touch
  bool circle_is_good = false;
  PressCoverage coverage{{1, 1}, 1};
  std::string headline, hint;  ///< what to do now, and where
  std::string warning;         ///< what was wrong, or ""
  bool closes = false;         ///< the session is over, and the window with it
};

/// A session that collects presses, as the window sees it. Called from the window's thread.
class CollectWatch {
 public:
  virtual ~CollectWatch() = default;
  virtual CollectView view() const = 0;
  virtual void take_back() = 0;  ///< the last press
};

struct CollectWindowOptions : viewer::WindowLoopOptions {
  CollectWindowOptions() { title = "Ball presses - GelSLAM", picture_stem = "presses", poll_s = 1.0 / 30; }
};

/// Shows a session until the person closes the window (Q, Esc) or view().closes; U takes the last press back.
/// Main thread. Throws Error when there is no display, and when the snapshot cannot be written.
void run_collect_window(CollectWatch& session, const CollectWindowOptions& options);

/// The window as it would look now, drawn without a display and written as PNG. Throws Error.
void write_collect_snapshot(CollectWatch& session, const CollectWindowOptions& options);

}  // namespace gelslam
