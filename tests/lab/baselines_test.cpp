#include "baselines/baselines.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "../support/analytic_surface.hpp"

namespace gelslam {
namespace {

using namespace test;

/// A sharp-edged texture on a round body: every method has something to hold on to.
const Field& body() {
  static const Field field = bumpy_ellipsoid(5, {9, 7, 6}, 0.25);
  return field;
}

SurfacePtr seen_from(const Pose& moved) {
  return touch(body(), pressed(6.0, 0.9) * moved, View{.contact_width_px = 75, .contact_height_px = 65});
}

struct Case {
  std::string method;
  double deg, mm;  ///< how near it must come to the truth
};

class Methods : public testing::TestWithParam<Case> {
 protected:
  Registrar registrar() const { return make_registrar(GetParam().method, {}); }
  void expect_near(const RegistrationResult& found, const Pose& truth) const {
    EXPECT_TRUE(found.ok()) << describe(found.status) << " scr " << found.scr << " ccs " << found.ccs;
    expect_within(gap(found.target_T_reference, truth), GetParam().deg, GetParam().mm);
  }
};

TEST_P(Methods, FindAKnownMotionAndItsInverse) {
  const Pose a_T_b = motion(0.8, -0.6, 1.0, 0.15, -0.12, 0.02);
  const SurfacePtr a = seen_from(Pose::Identity()), b = seen_from(a_T_b);
  expect_near(registrar()(a).register_to(*b, Pose::Identity()), a_T_b.inverse());
  expect_near(registrar()(b).register_to(*a, Pose::Identity()), a_T_b);
}

TEST_P(Methods, SayThatSurfacesHaveNothingInCommon) {
  const SurfacePtr a = seen_from(Pose::Identity());
  const SurfacePtr other = touch(bumpy_ellipsoid(77, {9, 7, 6}, 0.25), pressed(6.0, 0.9));
  EXPECT_FALSE(registrar()(a).register_to(*other, Pose::Identity()).ok());

  const auto corner = [](double sign) {  // opposite corners of the sensor, with a start that keeps them there
    View view{.contact_width_px = 30, .contact_height_px = 25};
    view.contact_center_px = {sign * 110, sign * 80};
    return touch(textured_plane(4), motion(0, 0, 0, 0, 0, 0.5), view);
  };
  const RegistrationResult apart = registrar()(corner(-1)).register_to(*corner(1), Pose::Identity());
  EXPECT_FALSE(apart.ok());
}

// Without noise. NormalFlow reads between pixels; the others match points 0.07 to 0.14 mm apart along
// normals, which leaves the sliding of plane on plane to a share of that distance, and twist to that over the
// contact's 4 mm radius.
INSTANTIATE_TEST_SUITE_P(All, Methods,
                         testing::Values(Case{"normalflow", 0.05, 0.01}, Case{"icp", 0.5, 0.05},
                                         Case{"icp-tuned", 0.5, 0.05}, Case{"filterreg", 0.5, 0.05},
                                         Case{"filterreg-tuned", 0.5, 0.05}, Case{"fpfh", 0.5, 0.05}),
                         [](const auto& info) {
                           std::string name = info.param.method;
                           std::replace(name.begin(), name.end(), '-', '_');
                           return name;
                         });

TEST(Fpfh, NeedsNoStart) {
  const Pose a_T_b = motion(0.8, -0.6, 25.0, 0.5, -0.3, 0.02);
  const SurfacePtr a = seen_from(Pose::Identity()), b = seen_from(a_T_b);
  for (const FpfhOptions& options : {FpfhOptions{}, tuned_fpfh()}) {
    const RegistrationResult found = make_fpfh(options)(a).register_to(*b, motion(0, 0, 170, 3, 3, 0));
    expect_within(gap(found.target_T_reference, a_T_b.inverse()), 0.5, 0.05);
  }
}

TEST(FilterReg, LeavesOutWhatHasNoPartner) {
  const Pose a_T_b = motion(0.8, -0.6, 1.0, 0.15, -0.12, 0.02);
  const SurfacePtr a = seen_from(Pose::Identity());
  const auto b = std::make_shared<Surface>(*seen_from(a_T_b));
  b->height_mm = b->height_mm.clone();
  for (int v = 100; v < 120; ++v)
    for (int u = 130; u < 150; ++u) b->height_mm(v, u) += 0.6F;  // a crumb on the gel
  FilterRegOptions options;
  options.outlier_share = 0.1;
  const RegistrationResult found = make_filter_reg(options)(a).register_to(*b, Pose::Identity());
  expect_within(gap(found.target_T_reference, a_T_b.inverse()), 0.5, 0.05);
}

TEST(JudgePose, KnowsRightFromWrongWithoutMovingThePose) {
  const Pose a_T_b = motion(0.8, -0.6, 1.0, 0.15, -0.12, 0.02);
  const NormalFlowReference a(seen_from(Pose::Identity()), {});
  const SurfacePtr b = seen_from(a_T_b);
  const RegistrationResult right = judge_pose(a, *b, a_T_b.inverse(), {});
  EXPECT_TRUE(right.ok());
  EXPECT_TRUE(right.target_T_reference.isApprox(a_T_b.inverse()));
  EXPECT_LT(right.height_rmse_mm, 0.01);
  EXPECT_GT(right.information.determinant(), 0);

  const RegistrationResult high = judge_pose(a, *b, motion(0, 0, 0, 0, 0, 0.3) * a_T_b.inverse(), {});
  EXPECT_NEAR(high.height_rmse_mm, 0.3, 0.01) << "heights that do not agree are seen";

  const RegistrationResult wrong = judge_pose(a, *b, motion(0, 0, 90, 1, 0, 0) * a_T_b.inverse(), {});
  EXPECT_FALSE(wrong.ok());
  EXPECT_LT(wrong.ccs, 0.5);
}

}  // namespace
}  // namespace gelslam
