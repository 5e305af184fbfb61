#pragma once

#include <array>
#include <map>
#include <optional>
#include <string>

#include "gelslam/backend/uncertain_motion.hpp"
#include "gelslam/frontend/tracker.hpp"

namespace gelslam {

/// How far a frame's pose in its trial may be off: each step from keyframe to keyframe adds its own error,
/// and slopes that are read too steep or too flat make every roll too long or too short. Only a loop closure
/// reduces it. Source: own.
class TrialDrift {
 public:
  /// `gradient_scale_sigma`: a slope is read 1 +- this times too steep (GradientScaleOptions).
  explicit TrialDrift(double gradient_scale_sigma) : gradient_scale_sigma_(gradient_scale_sigma) {}

  /// Every frame, in order. Covariance of trial_T_frame, x y z in mm, rx ry rz in rad, along the axes of this
  /// frame's sensor; empty where nothing was tracked.
  std::optional<Matrix6d> add(const TrackedFrame& frame);

 private:
  double gradient_scale_sigma_;
  int trial_ = -1;
  std::map<int, UncertainMotion> trial_T_keyframes_;  ///< of this trial, by keyframe id
};

/// A covariance of a pose's right perturbation (rx ry rz tx ty tz) with the translation first.
Matrix6d translation_first(const Matrix6d& rotation_first);
/// One standard deviation along each axis.
Vector6d sigma_of(const Matrix6d& covariance);

/// Two standard deviations of a pose from which on drift is reported.
inline constexpr double kLargeDriftMm = 1.0, kLargeDriftDeg = 5.0;  // message

/// "may be off by 1.6 mm along x, 6 degrees about y since the trial began": where the drift is large; else
/// "".
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
