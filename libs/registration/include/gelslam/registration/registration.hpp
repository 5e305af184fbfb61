#pragma once

#include <array>
#include <string>
#include <string_view>

#include "gelslam/core/uncertain_pose.hpp"

namespace gelslam {

/// Converts rotations to millimeters where both are compared: the distance from the axis, half a contact, at
/// which the motion is measured.
inline constexpr double kMmPerRad = 5.0;

/// The shortest period of a pattern that is looked for. Two shifts closer than this are the same place;
/// farther than this from where it was expected, a place was not expected at all.
inline constexpr double kMinPeriodMm = 1.0;

/// A motion (turns by kMmPerRad) is observable when its standard deviation is smaller: two of them
/// distinguish one period of a pattern from the next.
inline constexpr double kObservableSigmaMm = kMinPeriodMm / 4;

/// How well two curvatures have to agree (Huang et al., RA-L 2024). Without a unit.
struct CurvatureLimits {
  double min_scr = 0.3;  ///< shared curvature ratio
  double min_ccs = 0.7;  ///< curvature cosine similarity
};

enum class RegistrationStatus {
  converged,
  too_little_overlap,    ///< the shared contact or its share of curvature (SCR) is too small
  curvature_mismatch,    ///< CCS too low: the two patches do not show the same surface
  diverged,              ///< steps did not shrink, or the pose left the sensor
  free_space_violation,  ///< the object would lie in gel that the other surface shows untouched
  ambiguous,             ///< the textures agree nearly as well at another place
  too_little_surface,    ///< a surface without enough contact or texture to register at all
};

/// A sentence for a person: "too little overlap".
std::string_view describe(RegistrationStatus status);

/// The covariance of a pose of which nothing is known: kMinPeriodMm along every axis, turns by kMmPerRad.
Matrix6d unknown_pose_covariance();

/// Says what is known of target_T_reference before the surfaces are compared. What they do not show stays as
/// it is here. The covariance says by how much a pattern of the gel may have held the pose back.
struct PosePrior : UncertainPose {
  Matrix6d step_covariance = Matrix6d::Identity();  ///< of the last motion alone: how far the pose may move
  Pose start = Pose::Identity();                    ///< the initial guess

  PosePrior(const UncertainPose& target_T_reference, const Matrix6d& of_step)
      : UncertainPose(target_T_reference), step_covariance(of_step), start(pose) {}
  /// Makes a prior of an initial guess: its step covariance is unknown_pose_covariance() besides what the
  /// guess states itself.
  PosePrior(const UncertainPose& target_T_reference);  // NOLINT: a pose is a start
  PosePrior(const Pose& target_T_reference) : PosePrior(UncertainPose{target_T_reference}) {}  // NOLINT
};

struct RegistrationResult {
  RegistrationStatus status = RegistrationStatus::too_little_surface;
  Pose target_T_reference = Pose::Identity();
  /// Inverse covariance (rad, mm) of the right perturbation: true = target_T_reference * exp(noise); order rx
  /// ry rz tx ty tz, axes of the reference frame. Small along directions that the surface does not show.
  Matrix6d information = Matrix6d::Zero();
  /// Right perturbations as columns. The surfaces may show one of them and not another; `information` is that
  /// of each.
  Matrix6d directions = Matrix6d::Identity();
  double scr = 0.0;  ///< shared curvature ratio, 0..1
  double ccs = 0.0;  ///< curvature cosine similarity, -1..1
  /// Correlation of the two curvatures (means removed) over the shared contact, -1..1: near 0 where only
  /// noise or a broad shape is shared, which agrees with any place.
  double texture_correlation = 0.0;
  double normal_rmse_rad = 0.0;  ///< root mean square angle between aligned normals
  double height_rmse_mm = 0.0;   ///< root mean square height difference over the shared contact
  int shared_samples = 0;        ///< of the reference, inside both contacts
  /// of the shared contact as read, in the reference's frame
  Eigen::Vector3d shared_center_mm = Eigen::Vector3d::Zero();
  int iterations = 0;
  /// Says for x y z rx ry rz, along the axes of the target's sensor frame, whether both surfaces show this
  /// motion well enough to know it to 0.25 mm or 0.05 rad even where a pattern of the gel pulls against it;
  /// for z, whether both show bare gel.
  std::array<bool, 6> observable{};

  bool ok() const { return status == RegistrationStatus::converged; }
};

/// Says in words what the surface does not show: "sliding along x is not observable", or "" when it shows all
/// six motions.
std::string describe_observability(const std::array<bool, 6>& observable);

}  // namespace gelslam
