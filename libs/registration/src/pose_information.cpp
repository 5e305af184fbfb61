#include <Eigen/LU>
#include <algorithm>
#include <cmath>

#include "gelslam/surface/gradient_model.hpp"
#include "registration_quality.hpp"

namespace gelslam::registration::detail {
namespace {

// The following errors grow with the motion. The values are root mean squares over simulated sequences.
// A model's slope error differs over the gel, so an object that slides seems to tilt. The error is correlated
// over patches of this area, so a contact of a few patches averages little of it.
constexpr double kTiltRadPerMm = 0.002, kUnevenPatchMm2 = 40.0;
constexpr double kPerTilt = 0.007;  // error of the twist in rad, and of the slide in mm, per rad of tilt
constexpr double kSlidePerSlide = 0.0006;
constexpr double kDepthPerSlide =
    kTiltRadPerMm * kMmPerRad / 2;  // of a contact's border, 2.5 mm from its center

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
  // Where a direction is not observable, the true slide may be larger than the estimated one.
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

/// Returns the information that the normals give about the five motions, as perturbations about the
/// reference's origin.
Matrix5d information_of_normals(const ObservableDirections& directions, double noise_variance,
                                const PosePrior& prior) {
  const Matrix5d covariance = prior.covariance.topLeftCorner<kParameters, kParameters>();
  Matrix5d information = Matrix5d::Zero();
  for (int i = 0; i < kParameters; ++i) {
    const double fraction = directions.signal_fraction[i],
                 pull = directions.pattern_fraction[i] * directions.pattern_fraction[i];
    if (fraction == 0) continue;
    const Vector5d dual = directions.dual_basis.col(i);
    // This is Gauss-Newton with a noisy Jacobian: the error's variance is read / common², not 1 / read. A
    // pattern of the gel pulls towards no motion.
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
  // Where no bare gel is seen, a surface's level is unknown, and so is its pose's z. But the level is the
  // same for all that the surface is joined to: that it fits to them is known as well as elsewhere.
  noise(5, 5) += 1.0 / (options.height_noise_mm * options.height_noise_mm);

  // The result is (noise⁻¹ + variance)⁻¹, written for where the noise's information may have no inverse.
  const CenterMotion motion = motion_of(result);
  const Vector6d variance = motion_variance(motion, directions.signal_fraction.minCoeff() > 0, shared_mm2,
                                            slope_sigma_ratio, options);
  const Matrix6d both = (Matrix6d::Identity() + noise * variance.asDiagonal()).partialPivLu().solve(noise);
  return symmetric(to_center.transpose() * both * to_center);
}

}  // namespace gelslam::registration::detail
