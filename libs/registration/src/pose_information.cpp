// The information matrix of a registered pose (docs/algorithms.md, "Covariance" and "Errors of the motion").
// It is not in the papers. Three sources of error are added:
//
// * The noise of the normals, along the directions of motion that both surfaces show, and the noise of the
//   heights along z at the center of the shared contact.
// * A gel pattern, which pulls the pose toward no motion, by at most the uncertainty of the pose before the
//   registration.
// * Errors that grow with the motion from the reference to the target: slopes that are read too steep make a
//   roll too large by the same factor, and a slope error that differs over the gel makes a sliding object
//   seem to tilt.

#include <Eigen/LU>
#include <algorithm>
#include <cmath>

#include "gelslam/surface/gradient_model.hpp"
#include "registration_quality.hpp"

namespace gelslam::registration::detail {
namespace {

// Standard deviations of the errors that grow with the motion. The values are root mean squares over
// simulated sequences. The first is the error of the tilt per mm of sliding, on a large contact. The slope
// error of a model differs over the gel and is correlated over patches of kUnevenPatchMm2, so a smaller
// contact averages less of it. The last one is the error of z per mm of sliding.
constexpr double kTiltRadPerMm = 0.002, kUnevenPatchMm2 = 40.0;
constexpr double kPerTilt = 0.007;         // twist in rad, x and y in mm, per rad of tilt
constexpr double kSlidePerSlide = 0.0006;  // x and y, per mm of sliding
constexpr double kDepthPerSlide =
    kTiltRadPerMm * kMmPerRad / 2;  // the error of the tilt, 2.5 mm from the center

/// The motion of the center of the shared contact from the reference to the target, in the reference's axes.
struct CenterMotion {
  Eigen::Vector3d turn_rad, shift_mm;
  double tilt_rad() const { return turn_rad.head<2>().norm(); }
  double slide_mm() const { return shift_mm.head<2>().norm(); }
};

CenterMotion motion_of(const RegistrationResult& result) {
  const Pose& pose = result.target_T_reference;
  return {so3_log(pose.linear()), pose * result.shared_center_mm - result.shared_center_mm};
}

/// Returns the variances (rx ry rz tx ty tz, about the shared center) of the errors that grow with the
/// motion, for a model with this slope_sigma_ratio.
Vector6d motion_variance(const CenterMotion& motion, bool all_observable, double shared_mm2,
                         double slope_sigma_ratio, const NormalFlowOptions& options) {
  const double tilt = motion.tilt_rad();
  // If the surfaces do not show a direction at all, the true slide may be larger than the estimated one.
  const double slide = std::max(motion.slide_mm(), all_observable ? 0.0 : kMinPeriodMm);
  const double uneven_tilt =
      kTiltRadPerMm * slide * std::sqrt(1 + kUnevenPatchMm2 / std::max(shared_mm2, 1.0));
  const auto tilt_sigma = [&](double about, double other) {
    return std::hypot(options.gradient_scale_error * std::hypot(about, kCrossAxisShare * other), uneven_tilt);
  };
  const double slide_sigma = std::hypot(kPerTilt * tilt, kSlidePerSlide * slide);
  Vector6d sigma;
  sigma << tilt_sigma(motion.turn_rad.x(), motion.turn_rad.y()),
      tilt_sigma(motion.turn_rad.y(), motion.turn_rad.x()), kPerTilt * tilt, slide_sigma, slide_sigma,
      std::hypot(options.gradient_scale_error * motion.shift_mm.z(), kDepthPerSlide * slide);
  return (slope_sigma_ratio * sigma).cwiseAbs2();
}

/// Returns the information of the normals about the five parameters: for each direction, that of their noise
/// and of the gel pattern.
Matrix5d information_of_normals(const ObservableDirections& directions, double noise_variance,
                                const PosePrior& prior) {
  const Matrix5d covariance = prior.covariance.topLeftCorner<kParameters, kParameters>();
  Matrix5d information = Matrix5d::Zero();
  for (int i = 0; i < kParameters; ++i) {
    const double fraction = directions.signal_fraction[i],
                 pull = directions.pattern_fraction[i] * directions.pattern_fraction[i];
    if (fraction == 0) continue;
    const Vector5d dual = directions.dual_basis.col(i);
    // Because the Jacobian is noisy, the variance of the estimate is read / common² times that of the
    // normals, and not 1 / read times. The second term is the pull of a gel pattern.
    const double variance =
        noise_variance / (fraction * fraction) + pull * pull * dual.dot(covariance * dual);
    information += dual * dual.transpose() / variance;
  }
  return information;
}

}  // namespace

Matrix6d pose_information(const ObservableDirections& directions, double shared_mm2, double slope_sigma_ratio,
                          double noise_variance, const PosePrior& prior, const RegistrationResult& result,
                          const NormalFlowOptions& options) {
  const Matrix6d from_center = origin_from_center(result.shared_center_mm),
                 to_center = origin_from_center(-result.shared_center_mm);

  Matrix6d noise = Matrix6d::Zero();
  noise.topLeftCorner<kParameters, kParameters>() = information_of_normals(directions, noise_variance, prior);
  noise = (from_center.transpose() * noise * from_center).eval();
  // If no bare gel is seen, the level of the heights is unknown, and so is the z of the pose in the sensor
  // frame. The information is added nevertheless: that the two surfaces fit to each other at this z is known
  // as well as for others.
  noise(5, 5) += 1.0 / (options.height_noise_mm * options.height_noise_mm);

  // The result is (noise⁻¹ + variance)⁻¹, in a form that does not need the inverse of `noise`, which may be
  // singular.
  const CenterMotion motion = motion_of(result);
  const Vector6d variance = motion_variance(motion, directions.signal_fraction.minCoeff() > 0, shared_mm2,
                                            slope_sigma_ratio, options);
  const Matrix6d both = (Matrix6d::Identity() + noise * variance.asDiagonal()).partialPivLu().solve(noise);
  return symmetric(to_center.transpose() * both * to_center);
}

}  // namespace gelslam::registration::detail
