#pragma once

#include <array>
#include <string>
#include <vector>

#include "gelslam/core/run_report.hpp"
#include "gelslam/core/se3.hpp"
#include "gelslam/slam/map_snapshot.hpp"

namespace gelslam {

/// How far the poses of a finished map may be off, of the frames whose keyframe is placed in it. What was not
/// observable for a while (HiddenMotions), by motion.
RunReport::Uncertainty trajectory_uncertainty(const std::vector<FrameRecord>& frames, const MapSnapshot& map);

/// "poses may be off by 1.6 mm and 6 degrees: return to where you began" where the drift is large
/// (kLargeDriftMm), else what was not observable: "twisting is not observable in 10 frames, from 0.4 s on:
/// press on texture". At most one sentence.
std::vector<std::string> describe(const RunReport::Uncertainty& uncertainty);

/// A covariance of a pose's right perturbation (rx ry rz tx ty tz) with the translation first.
Matrix6d translation_first(const Matrix6d& rotation_first);
/// One standard deviation of each, the translation first.
Vector6d sigma_of(const Matrix6d& rotation_first);

/// Two standard deviations of a pose from which on drift is reported.
inline constexpr double kLargeDriftMm = 1.0, kLargeDriftDeg = 5.0;  // message

/// "may be off by 1.6 mm along x, 6 degrees about y": where the drift is large; else "". Translation first.
std::string describe_drift(const Vector6d& sigma);

/// Motions that are not observable, for display: a change counts once it has lasted. Counted in frames, so
/// that a log says the same at any rate.
class HiddenMotions {
 public:
  /// Takes the observability of a tracked frame.
  void pass(int trial, const std::array<bool, 6>& observable);

  /// describe_observability() of what has lasted; "" at the start of a trial.
  std::string words() const;
  /// The state that has lasted.
  const std::array<bool, 6>& observable() const { return observable_; }

 private:
  static constexpr int kLastingFrames = 12;  // message: half a second at 25 Hz

  int trial_ = -1;
  std::array<bool, 6> observable_{};  ///< as reported
  std::array<int, 6> differing_{};    ///< frames since one agreed with it
};

}  // namespace gelslam
