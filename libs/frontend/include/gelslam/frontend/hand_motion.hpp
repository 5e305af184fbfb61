#pragma once

#include "gelslam/core/uncertain_pose.hpp"
#include "gelslam/registration/registration.hpp"

namespace gelslam {

/// Filter state after a tracked frame.
struct MotionState {
  UncertainPose reference_T_frame;
  /// Velocity (rad/s, mm/s) along the axes of the frame, 0 along directions that the surfaces did not show.
  Vector6d velocity = Vector6d::Zero();
  /// Center of the contact, in the axes of the frame.
  Eigen::Vector3d center_mm = Eigen::Vector3d::Zero();

  /// Returns the state with the frame itself as the reference, for a frame that becomes the keyframe.
  MotionState in_itself() const { return {{}, velocity, center_mm}; }
};

/// Prediction of the next frame.
struct ExpectedMotion {
  Pose reference_T_before;
  UncertainPose reference_T_frame;
  Matrix6d step;  ///< Covariance of the motion since the previous frame only.
  double elapsed_s = 0;

  PosePrior prior() const;  ///< Prior of the registration, for frame_T_reference.
};

/// Motion model of a sensor that a hand moves over the object. Along directions that the surfaces show, the
/// hand keeps its velocity; along all others it moves at random, as fast as along those that are shown. The
/// speed (the process noise) is estimated with a short memory, and never falls below that of a hand at rest.
///
/// Errors along directions that the surface hardly shows (a pattern fixed to the gel, printed dots that are
/// dragged along, noise of the network) persist from frame to frame. The prior of a registration therefore
/// contains the uncertainty of one step only, which limits how far a frame can move the pose. The variances
/// of the steps add up until the surfaces show the direction. The filter is not in the papers; estimating the
/// speed from the motion itself is the idea of KISS-ICP (Vizzo et al., RA-L 2023, §III-D).
class HandMotion {
 public:
  /// Predicts the frame that comes `elapsed_s` after the state, at constant velocity.
  ExpectedMotion expect(const MotionState& before, double elapsed_s) const;

  /// Returns the state after a registration from expected.prior(), and updates the estimate of the hand's
  /// speed.
  MotionState correct(const ExpectedMotion& expected, const RegistrationResult& registration);

 private:
  static constexpr double kStartMmPerS = 1.6;  ///< Speed assumed at the beginning of each trial.
  /// Variance of the velocity per axis, in (mm/s)²; rotations count kMmPerRad mm per rad.
  double variance_ = kStartMmPerS * kStartMmPerS;
};

}  // namespace gelslam
