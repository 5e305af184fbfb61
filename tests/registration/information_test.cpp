#include <gtest/gtest.h>

#include <array>

#include "../support/analytic_surface.hpp"
#include "gelslam/core/se3.hpp"
#include "gelslam/registration/verification.hpp"

namespace gelslam {
namespace {

using namespace test;
using Vector5d = Eigen::Matrix<double, 5, 1>;

const Pose kAbove = motion(0, 0, 0, 0, 0, 0.4);

double smallest_eigenvalue(const Matrix6d& matrix) { return symmetric_eigen(matrix).values.minCoeff(); }

TEST(Information, IsSymmetricAndPositiveSemidefiniteOnEverySurface) {
  const std::pair<Field, Pose> surfaces[] = {{textured_plane(1), kAbove},
                                             {plane(), kAbove},
                                             {sphere(6), pressed(6, 1)},
                                             {cylinder(4), pressed(4, 1)},
                                             {extruded_edge(), motion(0, 0, 0, 0, 0, 1)}};
  for (const auto& [field, pose] : surfaces) {
    const SurfacePtr surface = touch(field, pose);
    const RegistrationResult result =
        register_normal_flow(NormalFlowReference(surface, {}), *surface, motion(1, 0, 2, 0.1, 0), {});
    EXPECT_TRUE(result.information.allFinite());
    EXPECT_TRUE(result.information.isApprox(result.information.transpose()));
    EXPECT_GE(smallest_eigenvalue(result.information), -1e-6 * result.information.norm());
  }
}

/// The information grows with the number of samples until there is one in each patch that shares its noise.
/// More samples add no information.
TEST(Information, GrowsWithSamplesUntilTheyShareTheirNoise) {
  const SurfacePtr surface = touch(textured_plane(1), kAbove);
  const auto information = [&](int samples) {
    NormalFlowOptions options;
    options.max_samples = samples;
    options.min_shared_samples = 50;
    Matrix6d known =
        register_normal_flow(NormalFlowReference(surface, options), *surface, Pose::Identity(), options)
            .information;
    known.row(5).setZero();  // tz is measured by the heights, whatever the number of samples
    known.col(5).setZero();
    known(5, 5) = samples;
    return known;
  };
  const Matrix6d few = information(250), many = information(2000), most = information(4000);
  EXPECT_GT(smallest_eigenvalue(many - few), 0);
  EXPECT_LT((most - many).topLeftCorner(5, 5).norm(), 0.2 * many.topLeftCorner(5, 5).norm());
}

/// Registers many noisy targets to one reference without noise, and computes the mean squared error, weighted
/// by the information. With exact information it has a chi-square distribution with 5 degrees of freedom (tz,
/// whose noise is another one, is left out), so its mean is 5, which 40 draws determine to 0.5. Two
/// approximations change the mean by a factor. The residual of a normal has two components, and the square of
/// both is taken for the variance of one (mean 2.5). Bilinear interpolation averages up to four pixels, which
/// reduces the variance to as little as a quarter but correlates neighboring samples. The mean must therefore
/// be between 1.25 and 10.
TEST(Information, MatchesTheSpreadUnderWhiteNoise) {
  constexpr double kNoiseRad = 0.02;
  constexpr int kDraws = 40;
  NormalFlowOptions options;
  options.normal_noise_rad = 1e-6;  // the noise follows from the residuals
  const Pose first_T_second = motion(0, 0, 0, 0.3 * 0.0634, 0.6 * 0.0634);  // not whole pixels
  const auto first = touch(textured_plane(1), kAbove),
             second = touch(textured_plane(1), kAbove * first_T_second);
  const NormalFlowReference reference(second, options);
  const Pose noise_free = register_normal_flow(reference, *first, first_T_second, options).target_T_reference;
  double mean = 0;
  for (std::uint64_t seed = 0; seed < kDraws; ++seed) {
    const RegistrationResult result =
        register_normal_flow(reference, *with_noise(*first, kNoiseRad, seed), first_T_second, options);
    ASSERT_TRUE(result.ok());
    const Vector5d error = se3_log(result.target_T_reference.inverse() * noise_free).head<5>();
    mean += error.dot(result.information.topLeftCorner<5, 5>() * error) / kDraws;
  }
  EXPECT_GT(mean, 1.25);
  EXPECT_LT(mean, 10.0);
}

/// The information belongs to right perturbations, in the axes of the reference. It must not depend on how
/// the target is rotated.
TEST(Information, IsInTheReferencesAxes) {
  const SurfacePtr second = touch(textured_plane(1), kAbove * motion(0, 0, 90, 0, 0)),
                   first = touch(textured_plane(1), kAbove);
  View narrow;  // inside both pictures, however they are rotated
  narrow.contact_width_px = narrow.contact_height_px = 80;
  const SurfacePtr inner = touch(textured_plane(1), kAbove * motion(0, 0, 90, 0, 0), narrow);
  NormalFlowOptions noisy;  // so that the errors that grow with the motion matter little
  noisy.normal_noise_rad = 0.2;
  const RegistrationResult turned =
      register_normal_flow(NormalFlowReference(inner, {}), *first, motion(0, 0, 90, 0, 0), noisy);
  const RegistrationResult straight =
      register_normal_flow(NormalFlowReference(inner, {}), *second, Pose::Identity(), noisy);
  ASSERT_TRUE(turned.ok() && straight.ok());
  const double size = straight.information.norm();
  EXPECT_LT((turned.information - straight.information).norm(), 0.02 * size);
  const Matrix6d to_target = adjoint(motion(0, 0, 90, 0, 0));
  const Matrix6d in_targets_axes = to_target.transpose() * straight.information * to_target;
  EXPECT_GT((turned.information - in_targets_axes).norm(), 0.1 * size) << "the axes make a difference";
}

/// An edge along the keyframe's x does not show sliding along it. After the sensor has twisted by a quarter
/// turn, the motion that is not observable is along the y axis of the sensor.
TEST(Information, ObservabilityIsAboutTheAxesOfTheSensorAsItLiesNow) {
  const Pose object_T_sensor = motion(0, 0, 0, 0, 0, 1), quarter_turn = motion(0, 0, 90, 0, 0);
  View square;
  square.contact_width_px = square.contact_height_px = 120;
  const NormalFlowReference reference(touch(extruded_edge(), object_T_sensor, square), {});
  const SurfacePtr now = touch(extruded_edge(), object_T_sensor * quarter_turn, square);
  const RegistrationResult result = register_normal_flow(reference, *now, quarter_turn.inverse(), {});
  ASSERT_TRUE(result.ok());
  EXPECT_EQ(result.observable, (std::array<bool, 6>{true, false, true, true, true, true}))
      << describe_observability(result.observable);
}

/// A round bump shows how it slides, but not how it turns about itself. Observability is that of the motion
/// of the contact: a bump far from the center of the sensor does not make sliding unobservable, although
/// turning about the bump moves the origin of the sensor.
TEST(Information, ObservabilityIsAboutWhereTheContactIs) {
  for (const Eigen::Vector2d& center_mm :
       {Eigen::Vector2d(0, 0), Eigen::Vector2d(6, 4), Eigen::Vector2d(-7, 3)}) {
    const Field bump = [center_mm](const Eigen::Vector3d& p) {
      constexpr double kHeightMm = -0.3, kWidthMm = 0.8;
      const Eigen::Vector2d from = (p.head<2>() - center_mm) / kWidthMm;
      const double height = kHeightMm * std::exp(-0.5 * from.squaredNorm());
      return std::pair{p.z() - height,
                       Eigen::Vector3d(height / kWidthMm * from.x(), height / kWidthMm * from.y(), 1)};
    };
    View view;
    view.contact_width_px = view.contact_height_px = 35;
    view.contact_center_px = center_mm / view.pixel_pitch_mm;
    const SurfacePtr surface = touch(bump, kAbove, view);
    const RegistrationResult result =
        register_normal_flow(NormalFlowReference(surface, {}), *surface, Pose::Identity(), {});
    ASSERT_TRUE(result.ok()) << center_mm.transpose();
    EXPECT_FALSE(result.observable[5]) << center_mm.transpose();
    EXPECT_TRUE(result.observable[0] && result.observable[1]) << center_mm.transpose();
  }
}

// A gel pattern pulls the pose toward no motion, by an error that may be as large as the uncertainty of the
// prior. The information must therefore be smaller if the prior was less certain.
TEST(Information, IsLessOfAPlaceThatWasHardlyKnown) {
  const NormalFlowReference touched(touch(textured_plane(1, 0.03), kAbove), {});
  const auto sigma_mm = [&](double known_to_mm) {
    Matrix6d covariance = Matrix6d::Zero();
    covariance.bottomRightCorner<3, 3>().diagonal().setConstant(known_to_mm * known_to_mm);
    const RegistrationResult result =
        verify(touched, touched, {Pose::Identity(), covariance}, PlacePrior::odometry, {}, {});
    return UncertainPose{result.target_T_reference, result.information.inverse()}.worst_sigma_mm();
  };
  EXPECT_GT(sigma_mm(3), 2 * sigma_mm(0.1));
}

}  // namespace
}  // namespace gelslam
