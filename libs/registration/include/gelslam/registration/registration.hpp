#pragma once

#include <array>
#include <string>
#include <string_view>

#include "gelslam/core/uncertain_pose.hpp"

namespace gelslam {

/// The factor that converts rotations to lengths where the two are compared: the motion of a point at a
/// distance of 5 mm from the axis, half the width of a typical contact.
inline constexpr double kMmPerRad = 5.0;

/// The shortest period of a repeating texture that is taken into account, in mm. Two shifts that differ by
/// less are the same place, and a place that is farther than this from the expected one is an unexpected one.
inline constexpr double kMinPeriodMm = 1.0;

/// A motion is observable if its standard deviation is smaller than this (rotations are multiplied by
/// kMmPerRad). Two standard deviations are then half a period, so that one period is not mistaken for the
/// next.
inline constexpr double kObservableSigmaMm = kMinPeriodMm / 4;

/// How well the curvatures of two surfaces have to agree (Huang et al., RA-L 2024). Both have no unit.
struct CurvatureLimits {
  double min_scr = 0.3;  ///< shared curvature ratio
  double min_ccs = 0.7;  ///< curvature cosine similarity
};

/// The outcome of a registration.
enum class RegistrationStatus {
  converged,             ///< the registration is accepted
  too_little_overlap,    ///< too few samples or too little of the curvature (SCR) are in the shared contact
  curvature_mismatch,    ///< the curvatures do not agree (CCS), so the surfaces are not the same
  diverged,              ///< the steps did not become small before the iterations ended
  free_space_violation,  ///< the object would lie in gel that the other surface shows untouched
  ambiguous,             ///< the textures agree nearly as well at another place
  too_little_surface,    ///< one of the surfaces has too little contact to be registered
};

/// Returns a short description for the user, for example "too little overlap".
std::string_view describe(RegistrationStatus status);

/// Returns the covariance that is assumed for a pose of which nothing is known: a standard deviation of
/// kMinPeriodMm along each axis, and of kMinPeriodMm / kMmPerRad = 0.2 rad about each axis.
Matrix6d unknown_pose_covariance();

/// What is known of target_T_reference before the surfaces are compared. Along motions that the surfaces do
/// not show, the result of the registration stays at the pose of the prior. Covariances are those of right
/// perturbations (rx ry rz tx ty tz, in rad and mm).
///
/// The registration uses `step_covariance`. `covariance`, the uncertainty of the pose before the
/// registration, is used only for the information of the result: a gel pattern pulls the pose toward no
/// motion, by an error that is at most as large as this covariance (docs/algorithms.md).
struct PosePrior : UncertainPose {
  /// The covariance of the motion since the last frame alone.
  Matrix6d step_covariance = Matrix6d::Identity();
  Pose start = Pose::Identity();  ///< the initial value of target_T_reference

  PosePrior(const UncertainPose& target_T_reference, const Matrix6d& of_step)
      : UncertainPose(target_T_reference), step_covariance(of_step), start(pose) {}
  /// Makes a prior from an initial value without a motion model. The step covariance is the covariance of the
  /// initial value plus unknown_pose_covariance().
  PosePrior(const UncertainPose& target_T_reference);  // NOLINT: a pose is a start
  PosePrior(const Pose& target_T_reference) : PosePrior(UncertainPose{target_T_reference}) {}  // NOLINT
};

/// The result of a registration.
struct RegistrationResult {
  RegistrationStatus status = RegistrationStatus::too_little_surface;
  Pose target_T_reference = Pose::Identity();
  /// The inverse covariance of the right perturbation xi of the pose, for which the true pose is
  /// target_T_reference * exp(xi), in the order rx ry rz tx ty tz (rad, mm) and the axes of the reference
  /// frame. It is small along motions that the surfaces do not show.
  Matrix6d information = Matrix6d::Zero();
  /// Six independent directions of motion as columns, which are right perturbations. Each of them is either
  /// shown by both surfaces, to some degree, or not. The last one is z.
  Matrix6d directions = Matrix6d::Identity();
  double scr = 0.0;  ///< shared curvature ratio, 0..1
  double ccs = 0.0;  ///< curvature cosine similarity, -1..1
  /// The correlation coefficient of the two curvatures over the shared contact, -1..1. It is near 0 if the
  /// surfaces share only noise or a broad shape, which would also agree at other places.
  double texture_correlation = 0.0;
  double normal_rmse_rad = 0.0;  ///< root mean square residual of the normals
  double height_rmse_mm = 0.0;   ///< root mean square height difference over the shared contact
  int shared_samples = 0;  ///< the number of samples of the reference that fall on contact of the target
  /// The center of the shared contact in the reference frame.
  Eigen::Vector3d shared_center_mm = Eigen::Vector3d::Zero();
  int iterations = 0;
  /// Whether the motions x y z rx ry rz, along the axes of the target's sensor frame and about the center of
  /// the shared contact, are observable: the standard deviation that follows from the two surfaces alone,
  /// with the possible effect of a gel pattern, is below kObservableSigmaMm (0.25 mm or 0.05 rad). z is
  /// observable if both surfaces show bare gel.
  std::array<bool, 6> observable{};

  bool ok() const { return status == RegistrationStatus::converged; }
};

/// Returns a text for the user about the motions that are not observable, for example "sliding along x is not
/// observable", or "" if all six are observable.
std::string describe_observability(const std::array<bool, 6>& observable);

}  // namespace gelslam
