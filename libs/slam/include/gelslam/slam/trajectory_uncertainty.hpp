#pragma once

#include <array>
#include <string>
#include <vector>

#include "gelslam/core/run_report.hpp"
#include "gelslam/core/se3.hpp"
#include "gelslam/slam/map_snapshot.hpp"

namespace gelslam {

/// Summarizes how uncertain the poses of a finished map are, over all frames whose keyframe is placed in it,
/// and which motions were unobservable for a while (UnobservableMotions).
RunReport::Uncertainty trajectory_uncertainty(const std::vector<FrameRecord>& frames, const MapSnapshot& map);

/// Describes the uncertainty in at most one sentence. If the drift is large (kLargeDriftMm) and the sensor
/// was farther from the map's origin (`farthest_mm`) than the drift, for example: "poses may be off by 1.6 mm
/// and 6 degrees: return to where you began". Otherwise it names what was not observable: "twisting is not
/// observable in 10 frames, from 0.4 s on: press on texture".
std::vector<std::string> describe(const RunReport::Uncertainty& uncertainty, double farthest_mm);

/// Returns one standard deviation along each axis, translation (mm) first, then rotation (rad), of a
/// covariance in which rotation comes first.
Vector6d sigma_of(const Matrix6d& rotation_first);

/// From these two standard deviations on, drift is reported.
inline constexpr double kLargeDriftMm = 1.0, kLargeDriftDeg = 5.0;

/// For a large drift returns e.g. "may be off by 1.6 mm along x, 6 degrees about y", else "". `sigma` has the
/// translation first.
std::string describe_drift(const Vector6d& sigma);

/// Finds intervals in which a motion is not observable. A change of observability counts only when it has
/// lasted for kLastingFrames. These are frames and not seconds, so that a log gives the same result at any
/// replay rate.
class UnobservableMotions {
 public:
  void pass(const FrameRecord& frame);  ///< Processes a frame, which must have a keyframe.

  /// Returns describe_observability() of the current lasting state; "" at the start of a trial.
  std::string words() const;
  /// Returns the lasting intervals for each motion.
  std::vector<RunReport::UnobservableMotion> all() const;

 private:
  static constexpr int kLastingFrames = 12;  // half a second at 25 Hz
  struct Motion {
    bool is_observable = true;
    int differing = 0;  ///< Number of frames since one agreed with the current state.
    RunReport::UnobservableMotion waiting{}, counted{};
  };

  int trial_ = -1;
  std::array<Motion, 6> motions_;
};

}  // namespace gelslam
