// Tests that the information of a registration is calibrated. Simulated sensors read slopes too steep or too
// flat, with errors that differ over the gel, and with noise. The squared errors of the poses, weighted by
// the information, must be distributed about as chi-square.

#include <gtest/gtest.h>

#include <array>

#include "../support/analytic_surface.hpp"
#include "gelslam/core/median.hpp"
#include "gelslam/registration/normal_flow.hpp"

namespace gelslam {
namespace {

using namespace test;

/// The systematic errors of a sensor, which are the same in every frame: factors of the slopes along x and y,
/// and a wave over the gel that is added to the slopes.
struct Faults {
  double gain_x = 1.0, gain_y = 1.0;
  Eigen::Vector2d wave_per_mm = Eigen::Vector2d::Zero();
  double phase = 0.0, unevenness_rad = 0.0;
};

/// Returns random errors. `size`: their standard deviation relative to that of a model that states no
/// uncertainty.
Faults draw_faults(std::mt19937_64& random, double size) {
  constexpr double kGain = 0.05, kWavelengthMm = 8.0, kUnevennessRad = 0.01;
  const double around = uniform(random, 0, 2 * M_PI);
  return {1.0 + size * kGain * normal_deviate(random), 1.0 + size * kGain * normal_deviate(random),
          2 * M_PI / kWavelengthMm * Eigen::Vector2d(std::cos(around), std::sin(around)),
          uniform(random, 0, 2 * M_PI), size * kUnevennessRad};
}

SurfacePtr as_read(const Field& field, const Pose& object_T_sensor, const Faults& faults,
                   double slope_sigma_ratio, std::uint64_t seed) {
  const auto surface = touch(field, object_T_sensor);
  surface->slope_sigma_ratio = slope_sigma_ratio;
  cv::Mat1f gx(surface->contact.size(), 0.0F), gy(surface->contact.size(), 0.0F);
  for (int v = 0; v < gx.rows; ++v)
    for (int u = 0; u < gx.cols; ++u) {
      cv::Vec3f& n = surface->normals(v, u);
      const Eigen::Vector2d at_mm((u - 159.5) * surface->pixel_pitch_mm,
                                  (v - 119.5) * surface->pixel_pitch_mm);
      const double wave = faults.unevenness_rad * std::sin(faults.wave_per_mm.dot(at_mm) + faults.phase);
      gx(v, u) = static_cast<float>(-n[0] / n[2] * faults.gain_x + wave);
      gy(v, u) = static_cast<float>(-n[1] / n[2] * faults.gain_y - wave);
      n = cv::normalize(cv::Vec3f(-gx(v, u), -gy(v, u), 1));
    }
  surface->height_mm *= 0.5 * (faults.gain_x + faults.gain_y);
  set_curvature(*surface, gx, gy);
  return with_noise(*surface, 0.01, seed, 2.0);
}

/// The parameter is the size of the systematic errors, which the model states as its uncertainty.
class CalibratedInformation : public testing::TestWithParam<double> {};

TEST_P(CalibratedInformation, ErrorsOverSigmasHaveTheRightSize) {
  constexpr int kPairs = 24;
  const std::pair<Field, Pose> objects[] = {{textured_plane(1), motion(0, 0, 0, 0, 0, 0.5)},
                                            {bumpy_ellipsoid(2), pressed(6, 0.9)}};
  std::mt19937_64 random(7);
  std::vector<double> chi_square;
  std::array<double, 6> sum2{};
  for (int pair = 0; pair < kPairs; ++pair) {
    const auto& [field, object_T_first] = objects[pair % 2];
    const Faults faults = draw_faults(random, GetParam());
    const double size = uniform(random, 0, 1);  // small motions as between successive frames, and large ones
    const Pose first_T_second = motion(size * uniform(random, -5, 5), size * uniform(random, -5, 5),
                                       size * uniform(random, -8, 8), size * uniform(random, -1, 1),
                                       size * uniform(random, -1, 1), size * uniform(random, -0.1, 0.1));
    const auto seed = static_cast<std::uint64_t>(2 * pair);
    const SurfacePtr first = as_read(field, object_T_first, faults, GetParam(), seed),
                     second = as_read(field, object_T_first * first_T_second, faults, GetParam(), seed + 1);
    const RegistrationResult result =
        register_normal_flow(NormalFlowReference(second, {}), *first, first_T_second, {});
    ASSERT_TRUE(result.ok()) << describe(result.status);
    // The errors are taken about the shared center, where an error of the tilt causes none along z.
    const Pose at_center(Eigen::Translation3d(result.shared_center_mm));
    const Matrix6d adjoint_center = adjoint(at_center);
    const Matrix6d information = adjoint_center.transpose() * result.information * adjoint_center;
    const Vector6d error =
        se3_log(at_center.inverse() * result.target_T_reference.inverse() * first_T_second * at_center);
    chi_square.push_back(error.dot(information * error));
    const Matrix6d covariance = information.inverse();
    for (int axis = 0; axis < 6; ++axis)
      sum2[static_cast<std::size_t>(axis)] += error[axis] * error[axis] / covariance(axis, axis) / kPairs;
  }
  // Chi-square with six degrees of freedom has the median 5.35 and the 90th percentile 10.64. From 24 pairs,
  // both are estimated to about a half.
  EXPECT_GT(quantile(chi_square, 0.5), 5.35 / 2.5);
  EXPECT_LT(quantile(chi_square, 0.5), 5.35 * 2.5);
  EXPECT_GT(quantile(chi_square, 0.9), 10.64 / 2.5);
  EXPECT_LT(quantile(chi_square, 0.9), 10.64 * 2.5);
  for (std::size_t axis = 0; axis < 6; ++axis) {
    // The simulated heights have only an error of scale. Real ones are also bent by the errors over the gel,
    // so the error of z may be smaller here than its standard deviation.
    EXPECT_GT(std::sqrt(sum2[axis]), axis == 5 ? 0.1 : 0.4) << axis;
    EXPECT_LT(std::sqrt(sum2[axis]), 2.5) << axis;
  }
}

INSTANTIATE_TEST_SUITE_P(Models, CalibratedInformation, testing::Values(1.0, 0.3));

/// The same touch with the same noise gives the same information in pictures with more or fewer pixels.
TEST(Information, PixelsOfAnotherSizeTellTheSame) {
  const Field field = textured_plane(1);
  const Pose above = motion(0, 0, 0, 0, 0, 0.5), first_T_second = motion(1, -1, 2, 0.3, 0.2);
  const auto sigma_of_pixels = [&](double larger) {
    View view;
    view.width_px = static_cast<int>(larger * view.width_px);
    view.height_px = static_cast<int>(larger * view.height_px);
    view.contact_width_px *= larger;
    view.contact_height_px *= larger;
    view.pixel_pitch_mm /= larger;
    const auto read = [&](const Pose& object_T_sensor, std::uint64_t seed) {
      return with_noise(*touch(field, object_T_sensor, view), 0.01, seed, 3 * larger);
    };
    const SurfacePtr first = read(above, 1), second = read(above * first_T_second, 2);
    const RegistrationResult result =
        register_normal_flow(NormalFlowReference(second, {}), *first, first_T_second, {});
    EXPECT_TRUE(result.ok()) << describe(result.status);
    return Vector6d(result.information.inverse().diagonal().cwiseSqrt());
  };
  const Vector6d usual = sigma_of_pixels(1);
  for (const double larger : {0.75, 1.5}) {
    const Vector6d ratio = sigma_of_pixels(larger).cwiseQuotient(usual);
    EXPECT_GT(ratio.minCoeff(), 0.9) << larger << ": " << ratio.transpose();
    EXPECT_LT(ratio.maxCoeff(), 1.1) << larger << ": " << ratio.transpose();
  }
}

/// If a sensor may read slopes too steep, the pose is less certain after a longer roll, and most about the
/// axis about which it rolled.
TEST(Information, LessIsKnownOfALongerMotion) {
  const Field field = textured_plane(1);
  const Pose above = motion(0, 0, 0, 0, 0, 0.5);
  const auto sigma_rad = [&](const Pose& first_T_second, int axis) {
    const SurfacePtr first = touch(field, above), second = touch(field, above * first_T_second);
    const RegistrationResult result =
        register_normal_flow(NormalFlowReference(second, {}), *first, first_T_second, {});
    return std::sqrt(Matrix6d(result.information.inverse())(axis, axis));
  };
  const double still = sigma_rad(Pose::Identity(), 0), rolled = sigma_rad(motion(4, 0, 0, 0, 0), 0);
  EXPECT_GT(rolled, 2 * still);
  EXPECT_GT(rolled, 1.5 * sigma_rad(motion(4, 0, 0, 0, 0), 1));
  EXPECT_GT(sigma_rad(motion(0, 0, 0, 1.5, 0), 0), 1.5 * still);
}

}  // namespace
}  // namespace gelslam
