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

/// What a session that collects presses shows, at one time.
struct CollectView {
  cv::Mat3b bgr, background;            ///< the newest picture, and the bare gel; empty at first
  std::optional<ContactCircle> circle;  ///< found in this touch
  bool circle_is_good = false;
  PressCoverage coverage{{1, 1}, 1};
  std::string headline, hint;  ///< what to do now, and where
  std::string warning;         ///< what was wrong, or ""
  bool closes = false;         ///< the session is over, and the window with it
};

struct TakenPress {
  CalibrationPress press;
  FoundCircle found;
};

/// A session that collects presses, as the window sees it. Called from the window's thread.
class CollectWatch {
 public:
  virtual ~CollectWatch() = default;
  virtual CollectView view() const = 0;
  virtual std::vector<TakenPress> taken() = 0;  ///< since the last call
  /// The contacts of all presses of this ball that are to be used, as a person has decided.
  virtual void count(const std::vector<ContactCircle>& contacts) = 0;
  virtual double diameter_mm() const = 0;  ///< of the ball
};

struct PressWindowOptions : viewer::WindowLoopOptions {
  PressWindowOptions() { title = "Ball presses - GelSLAM", picture_stem = "presses"; }
  double pixel_pitch_mm = 0.0634;
};

/// Shows the camera of `camera`, if there is one, and press after press with its circle, until the person
/// ends it or view().closes; then what was decided is saved without a question. A disk that does not take it
/// keeps the window open; the person may leave all the same. options.asks_to_end is as if Q were pressed.
/// Main thread. Throws Error when there is no display, and when something stays unsaved at the end.
void run_press_window(LabelSession& session, CollectWatch* camera, const PressWindowOptions& options);

}  // namespace gelslam
