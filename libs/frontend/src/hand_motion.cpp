// A filter of the sensor's motion over the object that learns its process noise (own; a speed learned from
// the motion itself is the idea of KISS-ICP, Vizzo et al., RA-L 2023, section III-D).
//
// State: the pose in the keyframe with its covariance, and a velocity. Prediction: the pose moves on by
// velocity times elapsed time, and the step has the covariance (elapsed time)² variance_ along each axis,
// turns measured at kMmPerRad. Correction: along each of the independent directions of a registration, the
// pose keeps the larger of the registration's information and of what was known before; the prediction's
// variance counts as if the step went on for kSteadyS, for steps have one direction for some time. The
// velocity becomes the measured one times its Kalman gain, but changes by no more than the standard deviation
// of the speed. variance_ follows the squared speed of what the surfaces show, with a memory of kMemoryS,
// down to a hand at rest.
//
// Along a direction that the surfaces do not show, the velocity goes to 0 and the variance of the pose grows.
// After a sudden start, the velocity follows some frames late.

#include "gelslam/frontend/hand_motion.hpp"

#include <algorithm>
#include <cmath>

namespace gelslam {
namespace {

constexpr double kRestMmPerS = 0.1;    // a hand that holds still
constexpr double kMemoryS = 0.3;       // in which a hand starts or stops
constexpr double kSteadyS = 1;         // for so long a hand keeps its direction
constexpr double kMinElapsedS = 1e-3;  // between frames with the same time
constexpr double kTimeUnitS = 1e-6;    // rounds away what counting from another start changes

/// Returns the variance along each direction (columns whose inverse is `along`).
Vector6d variance_along(const Matrix6d& along, const Matrix6d& covariance) {
  return (along * covariance * along.transpose()).diagonal();
}

Vector6d information_along(const Matrix6d& directions, const Matrix6d& information) {
  return (directions.transpose() * information * directions).diagonal().cwiseMax(0.0);
}

/// Returns the share of a motion that is measured rather than expected: 0..1.
Vector6d gain(const Vector6d& variance, const Vector6d& information) {
  const auto certainty = variance.array() * information.array();
  return certainty / (1 + certainty);
}

/// Returns the squared size in mm² of the contact's motion along right perturbations (columns); turns by
/// kMmPerRad.
Vector6d sizes_mm2(const Matrix6d& directions, const Eigen::Vector3d& center_mm) {
  Matrix6d to_center = Matrix6d::Identity();
  to_center.topLeftCorner<3, 3>() *= kMmPerRad;
  to_center.bottomLeftCorner<3, 3>() = -skew(center_mm);
  return (to_center * directions).colwise().squaredNorm();
}

}  // namespace

PosePrior ExpectedMotion::prior() const {
  const UncertainPose frame_T_reference = reference_T_frame.inverse();
  const UncertainPose by_step = UncertainPose{reference_T_frame.pose, step}.inverse();
  return {frame_T_reference, by_step.covariance};
}

ExpectedMotion HandMotion::expect(const MotionState& before, double elapsed_s) const {
  elapsed_s = std::max(std::round(elapsed_s / kTimeUnitS) * kTimeUnitS, kMinElapsedS);
  Matrix6d unit = Matrix6d::Identity();  // what moves the contact by 1 mm
  unit.topLeftCorner<3, 3>() /= kMmPerRad;
  unit.bottomLeftCorner<3, 3>() = skew(before.center_mm) / kMmPerRad;
  const Matrix6d step = elapsed_s * elapsed_s * variance_ * unit * unit.transpose();
  const UncertainPose &here = before.reference_T_frame, moved{se3_exp(elapsed_s * before.velocity), step};
  return {here.pose, compose(here, moved), step, elapsed_s};
}

MotionState HandMotion::correct(const ExpectedMotion& expected, const RegistrationResult& registration) {
  const Pose& frame_T_reference = registration.target_T_reference;
  const Matrix6d to_frame = adjoint(frame_T_reference), to_reference = to_frame.inverse();
  const Matrix6d directions = to_frame * registration.directions, along = inverted(directions);
  const Vector6d information = information_along(registration.directions, registration.information);
  // Steps have one direction for some time: their errors add up, rather than their variances.
  const Matrix6d drift = 2 * kSteadyS / expected.elapsed_s * expected.step;
  const Vector6d variance = variance_along(along, expected.reference_T_frame.covariance + drift);

  // What was known and is not shown now is still known.
  const Vector6d kept = (variance.cwiseInverse() - information).cwiseMax(0.0);
  const Matrix6d both = to_reference.transpose() * registration.information * to_reference +
                        along.transpose() * kept.asDiagonal() * along;
  MotionState state{{frame_T_reference.inverse(), both.inverse()},
                    Vector6d::Zero(),
                    frame_T_reference * registration.shared_center_mm};
  const Vector6d speed = along *
                         se3_log(expected.reference_T_before.inverse() * state.reference_T_frame.pose) /
                         expected.elapsed_s;
  const Vector6d of_step = gain(variance_along(along, expected.step), information);

  // The speed is learned over the directions that normals tell; the height is pressed, not moved by hand.
  const Vector6d sizes = sizes_mm2(directions, state.center_mm);

  // No step changes the velocity by more than the speed of late: a damaged picture makes steps that no hand
  // makes.
  const Vector6d before = along *
                          se3_log(expected.reference_T_before.inverse() * expected.reference_T_frame.pose) /
                          expected.elapsed_s;
  const Vector6d change = of_step.cwiseProduct(speed) - before;
  const double change_mm_per_s = std::sqrt(change.cwiseAbs2().dot(sizes));
  state.velocity = directions * (before + std::min(1.0, std::sqrt(variance_) / change_mm_per_s) * change);
  const double shown = gain(variance, information).head<5>().sum();
  const double squares = speed.cwiseAbs2().cwiseProduct(sizes).head<5>().sum();
  variance_ += (squares - shown * variance_) / 5 * std::min(1.0, expected.elapsed_s / kMemoryS);
  variance_ = std::max(variance_, kRestMmPerS * kRestMmPerS);
  return state;
}

}  // namespace gelslam
