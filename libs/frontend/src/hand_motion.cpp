// A filter of the sensor's motion over the object that estimates its own process noise (not in the papers;
// estimating the speed from the motion itself is the idea of KISS-ICP, Vizzo et al., RA-L 2023, section
// III-D).
//
// State: the pose relative to the keyframe with its covariance, and a velocity. Prediction: the pose moves by
// velocity times elapsed time; the covariance of this step is (elapsed time)² * variance_ along each axis,
// where rotations count kMmPerRad mm per rad. Correction: along each independent direction of a registration,
// the pose keeps the larger of the information of the registration and that of the prediction. For this
// comparison the prediction is given the variance of a hand that keeps its error of velocity for kSteadyS,
// because errors of consecutive steps are correlated. The velocity becomes the measured one times its Kalman
// gain, but changes by at most the standard deviation of the velocity. variance_ follows the squared measured
// speed with the time constant kMemoryS, and never falls below that of a hand at rest.
//
// Along a direction that the surfaces do not show, the velocity decays to 0 and the variance of the pose
// grows. Limitation: after a sudden start the velocity follows some frames late. The equations are in
// docs/algorithms.md (Prior).

#include "gelslam/frontend/hand_motion.hpp"

#include <algorithm>
#include <cmath>

namespace gelslam {
namespace {

constexpr double kRestMmPerS = 0.1;    // Speed of a hand that holds still.
constexpr double kMemoryS = 0.3;       // Time in which a hand starts or stops.
constexpr double kSteadyS = 1;         // Time for which a hand keeps its direction.
constexpr double kMinElapsedS = 1e-3;  // Least time between frames, as some logs repeat a time stamp.
// Times are rounded to this, so that results do not depend on where a log's clock starts.
constexpr double kTimeUnitS = 1e-6;

/// Returns the variance along each direction. `along` is the inverse of the matrix that has the directions as
/// columns.
Vector6d variance_along(const Matrix6d& along, const Matrix6d& covariance) {
  return (along * covariance * along.transpose()).diagonal();
}

Vector6d information_along(const Matrix6d& directions, const Matrix6d& information) {
  return (directions.transpose() * information * directions).diagonal().cwiseMax(0.0);
}

/// Returns the Kalman gain of each direction, between 0 (only the prediction counts) and 1 (only the
/// measurement counts).
Vector6d gain(const Vector6d& variance, const Vector6d& information) {
  const auto certainty = variance.array() * information.array();
  return certainty / (1 + certainty);
}

/// Returns, for each right perturbation (column), the square of how far it moves the contact, in mm². A
/// rotation about the contact's center counts kMmPerRad mm per rad.
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
  // Each column of this matrix is a motion that moves the contact by 1 mm.
  Matrix6d unit = Matrix6d::Identity();
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
  // A hand keeps its direction for a while, so the errors of consecutive steps add up linearly, and their
  // variances do not simply add.
  const Matrix6d drift = 2 * kSteadyS / expected.elapsed_s * expected.step;
  const Vector6d variance = variance_along(along, expected.reference_T_frame.covariance + drift);

  // Information from earlier frames is kept along directions that this registration does not show.
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

  // Only the five directions that normals determine are used to estimate the speed. Along z the hand presses
  // and does not move.
  const Vector6d sizes = sizes_mm2(directions, state.center_mm);

  // The change of the velocity is limited to its standard deviation, because a damaged image causes steps
  // that no hand makes.
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
