// Registers surfaces that do not show every motion. The motions that they show must be estimated. The others
// must be reported as not observable, and along them the pose must stay at its initial value.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <Eigen/LU>

#include "../support/analytic_surface.hpp"
#include "gelslam/registration/normal_flow.hpp"

namespace gelslam {
namespace {

using namespace test;
using testing::ElementsAre;

RegistrationResult registered(const SurfacePtr& reference, const Surface& target, const Pose& initial) {
  return register_normal_flow(NormalFlowReference(reference, {}), target, initial, {});
}

TEST(DegenerateSurfaces, APlaneShowsTiltAndDepthOnly) {
  const SurfacePtr flat = touch(plane(), motion(0, 0, 0, 0, 0, 0.5));
  const SurfacePtr tilted = touch(plane(), motion(0, 0, 0, 0, 0, 0.5) * motion(2, -1.5, 0, 0, 0));
  const Pose initial = motion(0, 0, 6, 0.4, -0.3);  // motions that the plane does not show
  const RegistrationResult result = registered(tilted, *flat, initial);
  EXPECT_THAT(result.observable, ElementsAre(false, false, true, true, true, false));
  EXPECT_EQ(describe_observability(result.observable),
            "sliding along x, sliding along y, twisting are not observable");
  // The tilt is found: the result maps the normal of the tilted plane to that of the flat one.
  const Eigen::Vector3d normal =
      result.target_T_reference.linear() * motion(2, -1.5, 0, 0, 0).linear().transpose().col(2);
  EXPECT_LT(std::acos(std::min(1.0, normal.z())) / kDegree, 0.02);
  // Sliding and twisting keep their initial values. The tolerances are not zero, because a twist of a tilted
  // plane changes its tilt and is therefore shown to some degree, and because the plane is tilted about the
  // contact, half a millimeter from the origin.
  EXPECT_LT((result.target_T_reference.translation() - initial.translation()).head<2>().norm(), 0.03);
  EXPECT_NEAR(so3_log(result.target_T_reference.linear()).z() / kDegree, 6, 0.5);
}

TEST(DegenerateSurfaces, ABallShowsWhereItsCenterIsAndNothingElse) {
  constexpr double kRadius = 6;
  const Eigen::Vector3d center_in_sensor(0, 0, kRadius - 1);
  const SurfacePtr target = touch(sphere(kRadius), pressed(kRadius, 1)),
                   reference = touch(sphere(kRadius), pressed(kRadius, 1));
  const auto about_center = [&](const Eigen::Vector3d& turn_deg) {
    Pose pose = Pose::Identity();
    pose.linear() = so3_exp(turn_deg * kDegree);
    pose.translation() = center_in_sensor - pose.linear() * center_in_sensor;
    return pose;
  };
  // A ball that is turned about its center looks the same, so the pose must stay at such an initial value.
  for (const Eigen::Vector3d& turn_deg :
       {Eigen::Vector3d(3, 0, 0), Eigen::Vector3d(0, -3, 0), Eigen::Vector3d(0, 0, 10)}) {
    const RegistrationResult result = registered(reference, *target, about_center(turn_deg));
    EXPECT_THAT(result.observable, ElementsAre(false, false, true, false, false, false));
    EXPECT_LT(gap(result.target_T_reference, about_center(turn_deg)).deg, 0.05) << turn_deg.transpose();
    EXPECT_LT(gap(result.target_T_reference, about_center(turn_deg)).mm, 0.01) << turn_deg.transpose();
  }
  // From an initial value with another center, the center is found.
  const RegistrationResult result = registered(reference, *target, motion(0, 0, 0, 0.3, -0.2));
  EXPECT_LT((result.target_T_reference * center_in_sensor - center_in_sensor).norm(), 0.01);
}

TEST(DegenerateSurfaces, ACylinderHidesSlidingAlongAndRollingAboutItsAxis) {
  constexpr double kRadius = 4;
  const Eigen::Vector3d on_axis(0, 0, kRadius - 1);
  const SurfacePtr target = touch(cylinder(kRadius), pressed(kRadius, 1)),
                   reference = touch(cylinder(kRadius), pressed(kRadius, 1) * motion(0, 1, 3, 0, 0));
  Pose rolled = Pose::Identity();  // about the axis, and along it
  rolled.linear() = so3_exp({4 * kDegree, 0, 0});
  rolled.translation() = on_axis - rolled.linear() * on_axis + Eigen::Vector3d(0.4, 0, 0);
  const RegistrationResult stays = registered(target, *target, rolled);
  EXPECT_THAT(stays.observable, ElementsAre(false, false, true, false, true, true));
  expect_within(gap(stays.target_T_reference, rolled), 0.05, 0.01);
  // The surfaces show the direction of the axis, so twist and pitch are found.
  const RegistrationResult turned = registered(reference, *target, Pose::Identity());
  const Eigen::Vector3d axis =
      turned.target_T_reference.linear() * motion(0, 1, 3, 0, 0).linear().transpose().col(0);
  EXPECT_LT(std::acos(std::min(1.0, axis.x())) / kDegree, 0.05);
  // Along the axis the pose stays, except for an effect of second order in the 3 degrees between its
  // directions.
  EXPECT_LT(std::abs(turned.target_T_reference.translation().x()), 0.02);
}

TEST(DegenerateSurfaces, AnEdgeHidesSlidingAlongItOnly) {
  const Pose object_T_first = motion(0, 0, 0, 0, 0, 1.0), first_T_second = motion(2, 1, -3, 0, 0.2, 0);
  const SurfacePtr target = touch(extruded_edge(), object_T_first),
                   reference = touch(extruded_edge(), object_T_first * first_T_second);
  const Pose initial = motion(0, 0, 0, 0.5, 0);
  const RegistrationResult result = registered(reference, *target, initial);
  EXPECT_THAT(result.observable, ElementsAre(false, true, true, true, true, true));
  const Pose expected = Eigen::Translation3d(0.5, 0, 0) * first_T_second;
  EXPECT_LT(gap(result.target_T_reference, expected).deg, 0.05);
  // The prior has a standard deviation of 1 mm, so noise may move the pose a little along the edge.
  EXPECT_LT(gap(result.target_T_reference, expected).mm, 0.05);
}

/// Noise looks like texture. It must neither be taken for the texture of the object, nor hide the motions
/// that the object shows.
class NoisySurfaces : public testing::TestWithParam<std::pair<double, double>> {};  // rad, correlated over px

TEST_P(NoisySurfaces, ShowWhatTheirShapeShows) {
  const auto [noise_rad, correlation_px] = GetParam();
  const struct {
    const char* name;
    Field field;
    Pose pose;
    std::array<bool, 6> observable;
  } cases[] = {{"plane", plane(), motion(0, 0, 0, 0, 0, 0.5), {false, false, true, true, true, false}},
               {"ball", sphere(6), pressed(6, 1), {false, false, true, false, false, false}},
               {"cylinder", cylinder(4), pressed(4, 1), {false, false, true, false, true, true}},
               {"edge", extruded_edge(), motion(0, 0, 0, 0, 0, 1), {false, true, true, true, true, true}},
               {"coin", coin_face(), motion(0, 0, 0, 0, 0, 0.3), {true, true, true, true, true, true}}};
  for (const auto& c : cases) {
    const auto clean = touch(c.field, c.pose);
    for (std::uint64_t seed = 0; seed < 3; ++seed) {
      const RegistrationResult result =
          registered(with_noise(*clean, noise_rad, 2 * seed, correlation_px),
                     *with_noise(*clean, noise_rad, 2 * seed + 1, correlation_px), Pose::Identity());
      EXPECT_EQ(result.observable, c.observable)
          << c.name << " draw " << seed << ": " << describe_observability(result.observable);
      // Both surfaces show the same place, so the pose must be the identity along all observable axes.
      const Vector6d moved = se3_log(result.target_T_reference);
      for (int axis = 0; axis < 3; ++axis) {
        const bool slide_shown = c.observable[static_cast<std::size_t>(axis)],
                   turn_shown = c.observable[static_cast<std::size_t>(3 + axis)];
        EXPECT_LT(slide_shown ? std::abs(moved[3 + axis]) : 0.0, 0.03) << c.name << " draw " << seed;
        EXPECT_LT(turn_shown ? std::abs(moved[axis]) : 0.0, 0.3 * kDegree) << c.name << " draw " << seed;
      }
    }
  }
}

INSTANTIATE_TEST_SUITE_P(DegenerateSurfaces, NoisySurfaces,
                         testing::Values(std::pair{0.01, 0.0}, std::pair{0.02, 0.0}, std::pair{0.01, 3.0},
                                         std::pair{0.02, 3.0}, std::pair{0.01, 5.0}, std::pair{0.02, 5.0}));

/// If an object covers the whole gel, the level of the heights is unknown, and so is the z of the pose. The
/// edge between two such surfaces must nevertheless have information about z from their heights, because
/// otherwise the map of a flat object would bend or break.
TEST(DegenerateSurfaces, WithoutBareGelSurfacesAreJoinedByTheirHeights) {
  const auto seen = touch(textured_plane(1), motion(0, 0, 0, 0, 0, 0.4));
  auto covered = std::make_shared<Surface>(*seen);
  covered->zero_is_bare_gel = false;
  const RegistrationResult seen_result = registered(seen, *seen, Pose::Identity());
  for (const auto& [reference, target] :
       {std::pair<SurfacePtr, SurfacePtr>{covered, seen}, {seen, covered}, {covered, covered}}) {
    const RegistrationResult result = registered(reference, *target, Pose::Identity());
    EXPECT_THAT(result.observable, ElementsAre(true, true, false, true, true, true));
    EXPECT_EQ(describe_observability(result.observable), "moving along z is not observable");
    EXPECT_TRUE(result.information.isApprox(seen_result.information, 1e-6));
  }
}

TEST(DegenerateSurfaces, TexturedSurfacesShowEverything) {
  const SurfacePtr surface = touch(textured_plane(1), motion(0, 0, 0, 0, 0, 0.4));
  const RegistrationResult result = registered(surface, *surface, Pose::Identity());
  EXPECT_THAT(result.observable, testing::Each(true));
  EXPECT_EQ(describe_observability(result.observable), "");
}

TEST(DegenerateSurfaces, NoiseDoesNotKeepARegistrationWandering) {
  // Noise moves the estimate step by step along motions that a ball or a rod does not show, although the
  // residuals do not become smaller. The registration has to stop nevertheless.
  NormalFlowOptions patient;
  patient.max_iterations = 1000;
  for (const Field& field : {sphere(6), cylinder(6)})
    for (std::uint64_t seed = 0; seed < 5; ++seed) {
      const SurfacePtr reference = with_noise(*touch(field, pressed(6, 1)), 0.02, 2 * seed),
                       target = with_noise(*touch(field, pressed(6, 1)), 0.02, 2 * seed + 1);
      const RegistrationResult result = register_normal_flow(NormalFlowReference(reference, patient), *target,
                                                             motion(0, 0, 5, 0.2, 0), patient);
      EXPECT_LE(result.iterations, 15) << seed;
    }
}

}  // namespace
}  // namespace gelslam
