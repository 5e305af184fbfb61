#pragma once

#include <opencv2/core/mat.hpp>
#include <optional>
#include <string>
#include <vector>

#include "gelslam/calibration/circle_finder.hpp"
#include "gelslam/calibration/press_coverage.hpp"
#include "gelslam/calibration/press_set.hpp"
#include "gelslam/viewer/window_options.hpp"

namespace gelslam {

class LabelSession;

/// The state of a session that collects presses, for the window.
struct CollectView {
  cv::Mat3b bgr, background;            ///< The newest image, and the bare gel; empty at first.
  std::optional<ContactCircle> circle;  ///< Circle found in the current touch.
  bool circle_is_good = false;
  PressCoverage coverage{{1, 1}, 1};
  std::string headline, hint;  ///< What to do now, and where.
  std::string warning;         ///< Problem with the last touch, or "".
  bool closes = false;         ///< True if the session is over and the window should close.
};

struct TakenPress {
  CalibrationPress press;
  FoundCircle found;
};

/// A session that collects presses, as the window uses it. Called from the window's thread.
class CollectWatch {
 public:
  virtual ~CollectWatch() = default;
  virtual CollectView view() const = 0;
  virtual std::vector<TakenPress> taken() = 0;  ///< Returns the presses since the last call.
  /// Tells the session which contacts of this ball's presses are to be used, according to the user's
  /// decisions.
  virtual void count(const std::vector<ContactCircle>& contacts) = 0;
  virtual double diameter_mm() const = 0;  ///< of the ball
};

struct PressWindowOptions : viewer::WindowLoopOptions {
  PressWindowOptions() { title = "Ball presses - GelSLAM", picture_stem = "presses"; }
  double pixel_pitch_mm = 0.0634;
};

/// Shows the camera of `camera`, if there is one, and the presses with their circles one by one, until the
/// user ends it or view().closes; the decisions are then saved without a question. If a file cannot be
/// written, the window stays open, but the user may still leave. options.asks_to_end acts like the key Q.
/// Must be called from the main thread. Throws Error when there is no display, and when decisions remain
/// unsaved at the end.
void run_press_window(LabelSession& session, CollectWatch* camera, const PressWindowOptions& options);

}  // namespace gelslam
