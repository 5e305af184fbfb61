#include "gelslam/registration/normal_flow.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "../support/analytic_surface.hpp"
#include "gelslam/registration/verification.hpp"

namespace gelslam {
namespace {

using namespace test;

// The errors that remain without noise. Normals are interpolated between pixels, which is wrong by up to
// 0.003 rad for waves of 1 mm with slopes of 0.15, with either sign, averaged over thousands of samples. The
// iterations end at steps of 1e-4 rad and 1e-2 mm.
constexpr double kExactDeg = 0.03, kExactMm = 0.01;

RegistrationResult register_pair(const SurfacePtr& reference, const Surface& target,
                                 const Pose& initial = Pose::Identity(),
                                 const NormalFlowOptions& options = {}) {
  return register_normal_flow(NormalFlowReference(reference, options), target, initial, options);
}

void expect_near(const RegistrationResult& result, const Pose& truth, double deg, double mm) {
  EXPECT_TRUE(result.ok()) << describe(result.status);
  expect_within(gap(result.target_T_reference, truth), deg, mm);
}

TEST(NormalFlow, FollowsAnObjectAcrossThePictureOfANearCamera) {
  View view;
  view.camera_distance_mm = 22;
  view.contact_width_px = 60, view.contact_height_px = 60;
  const auto seen_at = [&](double x_mm, const Pose& object_T_sensor) {
    View at = view;
    at.contact_center_px = {x_mm / view.pixel_pitch_mm, 0};
    return touch(bumpy_ellipsoid(2), object_T_sensor, at);
  };
  // The object slides by 8 mm and goes 0.2 mm deeper.
  const Pose left_T_right = motion(0, 0, 3, 8, 0.3, 0.2),
             object_T_left = pressed(6, 1.2) * motion(0, 0, 0, -4, 0, 0);
  const SurfacePtr left = seen_at(4, object_T_left), right = seen_at(-4, object_T_left * left_T_right);
  const Pose start = left_T_right * motion(0.5, -0.5, 1, 0.2, 0.1, 0.1);
  expect_near(register_pair(right, *left, start), left_T_right, kExactDeg, kExactMm);
}

// An object covers the whole gel and slides by half of its width. The part that both frames show lies at
// opposite borders of the two pictures, where rays are oblique in opposite directions. Only with the rays of
// the target is the effect of a rotation on its texture computed correctly.
TEST(NormalFlow, LeavesAWrongTiltOfWhatLiesAtTheBordersOfBothPictures) {
  const Field field = textured_plane(6, 0.25, 1.5, 3);
  View view;
  view.camera_distance_mm = 20;
  view.contact_width_px = 310, view.contact_height_px = 230;
  const Pose object_T_left = motion(0, 0, 0, 0, 0, 0.4), left_T_right = motion(0, 0, 0, 8, 0, 0);
  const SurfacePtr left = touch(field, object_T_left, view),
                   right = touch(field, object_T_left * left_T_right, view);
  const Pose border = motion(0, 0, 0, -4, 0, 0);  // in the right one's axes
  for (const double tilt_deg : {-6.0, -3.0, 3.0, 6.0}) {
    const Pose start = left_T_right * border * motion(0, tilt_deg, 0, 0, 0) * border.inverse();
    expect_near(register_pair(right, *left, start), left_T_right, kExactDeg, kExactMm);
  }
}

/// Dents that stay with the gel. Printed dots leave such a pattern where their pixels are interpolated.
SurfacePtr with_dots(const Surface& surface, bool known) {
  auto dotted = std::make_shared<Surface>(surface);
  dotted->normals = surface.normals.clone();
  dotted->curvature = surface.curvature.clone();
  dotted->confidence = surface.contact.clone();
  constexpr int kSpacingPx = 30;
  constexpr double kRadiusPx = 6;
  for (int v = 0; v < surface.contact.rows; ++v)
    for (int u = 0; u < surface.contact.cols; ++u) {
      const cv::Point2d from(u % kSpacingPx - kSpacingPx / 2, v % kSpacingPx - kSpacingPx / 2);
      if (surface.contact(v, u) == 0 || cv::norm(from) > kRadiusPx) continue;
      const cv::Vec3f steep(static_cast<float>(0.05 * from.x), static_cast<float>(0.05 * from.y), 0);
      dotted->normals(v, u) = cv::normalize(dotted->normals(v, u) + steep);
      dotted->curvature(v, u) = -0.1f;
      if (known) dotted->confidence(v, u) = 1;
    }
  return dotted;
}

TEST(NormalFlow, PixelsThatWereFilledInCarryNoTexture) {
  const Field field = textured_plane(1);
  const Pose first = motion(0, 0, 0, 0, 0, 0.4), moved = motion(0, 0, 4, 0.5, -0.3, 0.4);
  const Pose truth = moved.inverse() * first;
  const auto aligned = [&](bool known) {
    return register_pair(with_dots(*touch(field, first), known), *with_dots(*touch(field, moved), known));
  };
  expect_near(aligned(true), truth, 2 * kExactDeg, 2 * kExactMm);
  EXPECT_GT(aligned(true).ccs, 0.95);
  EXPECT_LT(aligned(false).ccs, 0.8) << "the dots are faint";
  const auto repeats = [&](bool known) { return self_similarity(*with_dots(*touch(field, first), known)); };
  EXPECT_LT(repeats(true), repeats(false));
}

/// An object that is touched at a first place, and then at places that differ from it by known motions.
struct Scene {
  const char* name;
  Field field;
  Pose object_T_first;
};

std::vector<Scene> scenes() {
  return {{"textured plane", textured_plane(1), motion(0, 0, 0, 0, 0, 0.4)},
          {"bumpy ellipsoid", bumpy_ellipsoid(2), pressed(6.0, 1.2)}};
}

class KnownMotions : public testing::TestWithParam<int> {
 protected:
  const Scene scene = scenes()[static_cast<std::size_t>(GetParam())];
  const SurfacePtr first = touch(scene.field, scene.object_T_first);
};

TEST_P(KnownMotions, AreRecoveredForwardInverseAndComposed) {
  const Pose a_T_b = motion(1.5, -2, 4, 0.25, -0.2, 0.02), b_T_c = motion(-2.5, -1, 3, -0.1, 0.3, -0.03);
  const Pose object_T_b = scene.object_T_first * a_T_b;
  const SurfacePtr b = touch(scene.field, object_T_b), c = touch(scene.field, object_T_b * b_T_c);

  const RegistrationResult forward = register_pair(b, *first), inverse = register_pair(first, *b);
  const RegistrationResult next = register_pair(c, *b), whole = register_pair(c, *first, a_T_b);
  expect_near(forward, a_T_b, kExactDeg, kExactMm);
  expect_near(inverse, a_T_b.inverse(), kExactDeg, kExactMm);
  expect_near(next, b_T_c, kExactDeg, kExactMm);
  expect_near(whole, a_T_b * b_T_c, kExactDeg, kExactMm);
  expect_within(gap(forward.target_T_reference * next.target_T_reference, whole.target_T_reference),
                2 * kExactDeg, 2 * kExactMm);
}

TEST_P(KnownMotions, AreRecoveredUnderNoise) {
  const Pose first_T_second = motion(2, 1, -5, -0.2, 0.25, 0.05);
  const SurfacePtr second = touch(scene.field, scene.object_T_first * first_T_second);
  constexpr double kNoiseRad = 0.03;  // more than a calibrated sensor's 0.01 to 0.02
  // White noise averages out over 3000 samples: with slopes that change by 0.3 rad/mm, its effect is below
  // 0.005 mm. The bias by noise in the gradients of the reference's normals does not average out. The limits
  // are ten times the expected error.
  for (std::uint64_t seed = 0; seed < 3; ++seed)
    expect_near(
        register_pair(with_noise(*second, kNoiseRad, 2 * seed), *with_noise(*first, kNoiseRad, 2 * seed + 1)),
        first_T_second, 0.2, 0.05);
}

// If noise is the largest part of the residuals, it is hard to see that they still become smaller. The
// iterations must not end early for that reason. The initial pose is as far off as one frame of a quick
// motion.
TEST_P(KnownMotions, AreReachedThroughHeavyNoise) {
  constexpr int kDraws = 12;
  constexpr double kNoiseRad = 0.08;
  int reached = 0;
  for (std::uint64_t seed = 0; seed < kDraws; ++seed) {
    const Pose first_T_second = motion(1, -1, 2, 0.1, -0.1, 0.02);
    const SurfacePtr second = touch(scene.field, scene.object_T_first * first_T_second);
    const RegistrationResult result = register_pair(with_noise(*second, kNoiseRad, 2 * seed, 2.0),
                                                    *with_noise(*first, kNoiseRad, 2 * seed + 1, 2.0),
                                                    first_T_second * motion(2, 2, 4, 0.3, 0.3));
    const PoseGap error = gap(result.target_T_reference, first_T_second);
    reached += error.mm < 0.3 && error.deg < 2 ? 1 : 0;
  }
  EXPECT_GE(reached, kDraws - 1);
}

TEST_P(KnownMotions, AreRecoveredFromTwentyDegreesOfTiltAndFortyOfTwist) {
  const Pose tilted = motion(20, 0, 0, 0.1, 0.2), twisted = motion(0, 0, 40, -0.1, 0.1),
             both = motion(12, -16, 40, 0, 0.1);
  // The error of the initial pose is that of a good prediction over one frame at 25 Hz.
  const Pose off = motion(1.5, -1, 2, 0.1, -0.1);
  for (const Pose& first_T_second : {tilted, twisted, both}) {
    Pose object_T_second = scene.object_T_first * first_T_second;
    const SurfacePtr second = touch(scene.field, object_T_second);
    const RegistrationResult result = register_pair(second, *first, first_T_second * off);
    EXPECT_GT(result.scr, 0.3);
    // In an oblique view the interpolation is less accurate, so twice the error of small motions is allowed.
    expect_near(result, first_T_second, 2 * kExactDeg, 2 * kExactMm);
  }
}

INSTANTIATE_TEST_SUITE_P(On, KnownMotions, testing::Values(0, 1), [](const auto& instance) {
  return instance.param == 0 ? "TexturedPlane" : "BumpyEllipsoid";
});

TEST(NormalFlow, DirtThatMovesWithTheGelDoesNotPull) {
  const Scene scene = scenes()[0];
  const Pose first_T_second = motion(0, 0, 3, 0.4, 0);
  auto first = touch(scene.field, scene.object_T_first),
       second = touch(scene.field, scene.object_T_first * first_T_second);
  for (const auto& surface : {first, second})
    for (const cv::Point at : {cv::Point(120, 90), cv::Point(190, 150), cv::Point(160, 120)})
      for (int dv = -6; dv <= 6; ++dv)
        for (int du = -6; du <= 6; ++du)  // a speck as steep as a grain of sand, 2.5 % of the contact in all
          surface->normals(at + cv::Point(du, dv)) =
              cv::normalize(cv::Vec3f(static_cast<float>(du) * 0.15f, static_cast<float>(dv) * 0.15f, 1));
  const RegistrationResult robust = register_pair(second, *first);
  NormalFlowOptions trusting;
  trusting.robust_scale_rad = 1e6;
  const RegistrationResult plain = register_pair(second, *first, Pose::Identity(), trusting);
  EXPECT_LT(gap(robust.target_T_reference, first_T_second).mm, 0.02);
  EXPECT_LT(gap(robust.target_T_reference, first_T_second).mm,
            0.5 * gap(plain.target_T_reference, first_T_second).mm);
}

TEST(NormalFlow, WithoutContactThereIsNothingToRegister) {
  const Scene scene = scenes()[0];
  const SurfacePtr full = touch(scene.field, scene.object_T_first);
  const SurfacePtr empty = touch(scene.field, motion(0, 0, 0, 0, 0, -3));
  ASSERT_EQ(empty->contact_pixels, 0);
  const Pose initial = motion(1, 2, 3, 0.4, 0.5, 0.6);
  EXPECT_EQ(NormalFlowReference(empty, {}).sample_count(), 0);
  for (const RegistrationResult& result :
       {register_pair(empty, *full, initial), register_pair(full, *empty, initial),
        register_pair(empty, *empty, initial)}) {
    EXPECT_EQ(result.status, RegistrationStatus::too_little_surface);
    EXPECT_TRUE(result.target_T_reference.isApprox(initial));
    EXPECT_TRUE(result.information.isZero());
  }
}

TEST(NormalFlow, ContactUpToTheImageBorder) {
  View whole;
  whole.contact_width_px = whole.contact_height_px = 1000;
  const Scene scene = scenes()[0];
  const Pose first_T_second = motion(1, -1, 4, 0.5, 0.4);
  const SurfacePtr first = touch(scene.field, scene.object_T_first, whole);
  const SurfacePtr second = touch(scene.field, scene.object_T_first * first_T_second, whole);
  ASSERT_EQ(first->contact_pixels, 320 * 240);
  expect_near(register_pair(second, *first), first_T_second, kExactDeg, kExactMm);

  View corner;
  corner.contact_center_px = {-150, -110};
  corner.contact_width_px = corner.contact_height_px = 60;
  const SurfacePtr a = touch(scene.field, scene.object_T_first, corner);
  const SurfacePtr b = touch(scene.field, scene.object_T_first * motion(0, 0, 0, 0.1, 0.1), corner);
  expect_near(register_pair(b, *a), motion(0, 0, 0, 0.1, 0.1), 0.1, 0.03);
}

TEST(NormalFlow, TooLittleOverlapIsSaid) {
  const Scene scene = scenes()[0];
  const SurfacePtr first = touch(scene.field, scene.object_T_first);
  for (const double x_mm : {10.0, 13.0, 40.0}) {  // the contact is 14 mm wide
    const Pose first_T_second = motion(0, 0, 0, x_mm, 0);
    const SurfacePtr second = touch(scene.field, scene.object_T_first * first_T_second);
    const RegistrationResult result = register_pair(second, *first, first_T_second);
    EXPECT_EQ(result.status, RegistrationStatus::too_little_overlap) << x_mm;
    EXPECT_LT(result.scr, 0.3);
    EXPECT_TRUE(result.target_T_reference.matrix().allFinite());
    EXPECT_TRUE(result.information.allFinite());
  }
}

TEST(NormalFlow, ADifferentSurfaceIsNoMatch) {
  const Scene scene = scenes()[0];
  const SurfacePtr first = touch(scene.field, scene.object_T_first);
  for (std::uint64_t seed = 10; seed < 16; ++seed) {
    const SurfacePtr other = touch(textured_plane(seed), scene.object_T_first);
    const RegistrationResult result = register_pair(other, *first);
    EXPECT_THAT(result.status,
                testing::AnyOf(RegistrationStatus::curvature_mismatch, RegistrationStatus::too_little_overlap,
                               RegistrationStatus::diverged))
        << describe(result.status);
    EXPECT_TRUE(result.target_T_reference.matrix().allFinite());
  }
}

// Near the right border of the picture, every normal is read as tilted by 6 degrees. The confidence there is
// a hundredth of that elsewhere, so these normals must hardly change the pose.
TEST(NormalFlow, NormalsOfLowConfidenceHardlyCount) {
  const Field field = textured_plane(4);
  const Pose truth = motion(0, 0, 0, 0.6, 0, 0);
  const auto read = [&](const Pose& object_T_sensor, bool states_it) {
    auto surface = std::make_shared<Surface>(*touch(field, object_T_sensor, everywhere()));
    surface->normals = surface->normals.clone();
    surface->confidence = surface->contact.clone();
    for (int v = 0; v < surface->normals.rows; ++v)
      for (int u = 200; u < surface->normals.cols; ++u) {
        cv::Vec3f& n = surface->normals(v, u);
        n = cv::normalize(cv::Vec3f(n[0] + 0.1F * static_cast<float>(u - 200) / 120, n[1], n[2]));
        surface->confidence(v, u) = 3;
      }
    if (!states_it) surface->confidence.release();
    return std::shared_ptr<const Surface>(surface);
  };
  const Pose first = motion(0, 0, 0, 0, 0, 0.4);
  const auto tilt_deg = [&](bool states_it) {
    const RegistrationResult result = register_pair(read(first * truth, states_it), *read(first, states_it));
    EXPECT_TRUE(result.ok());
    return gap(result.target_T_reference, truth).deg;
  };
  EXPECT_LT(tilt_deg(true), 0.2 * tilt_deg(false));
}

}  // namespace
}  // namespace gelslam
