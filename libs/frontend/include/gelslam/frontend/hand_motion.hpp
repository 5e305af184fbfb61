#pragma once

#include "gelslam/core/uncertain_pose.hpp"
#include "gelslam/registration/registration.hpp"

namespace gelslam {

/// What is known of a tracked frame's pose.
struct MotionState {
  UncertainPose reference_T_frame;
  Vector6d velocity = Vector6d::Zero();  ///< per second, along the frame's axes, as far as it was shown
  Eigen::Vector3d center_mm = Eigen::Vector3d::Zero();  ///< of the contact, in the frame

  /// Returns the state relative to the frame itself, which is the reference from now on.
  MotionState in_itself() const { return {{}, velocity, center_mm}; }
};

/// Where the next frame is expected.
struct ExpectedMotion {
  Pose reference_T_before;
  UncertainPose reference_T_frame;
  Matrix6d step;  ///< covariance of the motion since the frame before alone
  double elapsed_s = 0;

  PosePrior prior() const;  ///< of frame_T_reference
};

/// Models how a hand moves an object: at the velocity that the surfaces have shown, and along all other
/// directions at random, as fast as along those that they show. The speed is learned with a short memory,
/// down to that of a hand at rest.
///
/// The error of a direction that is hardly shown (the gel's own pattern, dragged dots, a network's noise)
/// persists from frame to frame. So the prior of a step alone tells how far a frame may move the pose, and
/// the variances of the steps add up until the surfaces show the direction. Source: own; a speed learned from
/// the motion itself is KISS-ICP's idea (Vizzo et al., RA-L 2023, §III-D).
class HandMotion {
 public:
  /// Predicts the next frame, `elapsed_s` later, if the motion goes on.
  ExpectedMotion expect(const MotionState& before, double elapsed_s) const;

  /// Returns the state after a registration from expected.prior(), which also tells how fast the hand moves.
  MotionState correct(const ExpectedMotion& expected, const RegistrationResult& registration);

 private:
  static constexpr double kStartMmPerS = 1.6;      ///< before the surfaces have shown more
  double variance_ = kStartMmPerS * kStartMmPerS;  ///< of the velocity, per axis; turns by kMmPerRad
};

}  // namespace gelslam
