#include "pipeline/slope_calibration.hpp"

#include <gtest/gtest.h>

#include "../support/analytic_surface.hpp"
#include "gelslam/backend/uncertain_motion.hpp"
#include "gelslam/registration/slope_sensitivity.hpp"

namespace gelslam {
namespace {

using namespace test;
using namespace slam::detail;

/// A stone looked at from many sides by a sensor whose slopes are read wrong, and what the tracker and the
/// pose graph made of it: all overlapping pairs registered on what was read, poses solved from them.
class CalibrateSlopes : public testing::Test {
 protected:
  void look(const std::vector<Pose>& looks, const SlopeCorrection& planted) {
    SlopeCorrection opposite;
    for (std::size_t k = 0; k < planted.factors.size(); ++k) opposite.factors[k] = -planted.factors[k];
    std::map<int, Pose> poses;
    for (const Pose& stone_T_sensor : looks) {
      auto keyframe = std::make_shared<Keyframe>();
      keyframe->id = static_cast<int>(keyframes.size());
      const auto seen = touch(stone, stone_T_sensor);
      auto surface = std::make_shared<Surface>(*SlopeCorrector().apply(*seen, opposite));
      surface->model_sigma = model_sigma;
      keyframe->surface = SurfacePtr(std::move(surface));
      keyframe->reference =
          std::make_shared<const NormalFlowReference>(keyframe->surface.get(), NormalFlowOptions{});
      truth[keyframe->id] = stone_T_sensor;
      keyframes.push_back(std::move(keyframe));
    }
    for (int to = 1; to < static_cast<int>(keyframes.size()); ++to)
      for (int from = 0; from < to; ++from) {
        const Pose start = truth.at(from).inverse() * truth.at(to);
        const RegistrationResult result =
            register_normal_flow(*keyframes[static_cast<std::size_t>(to)]->reference.get(),
                                 *keyframes[static_cast<std::size_t>(from)]->surface.get(), start, {});
        if (result.ok())
          edges.push_back({from, to, result.target_T_reference, result.information,
                           from + 1 == to ? EdgeKind::odometry : EdgeKind::loop, result.shared_center_mm});
      }
    solution = solve_pose_graph(truth, edges, options);
  }

  SlamMap read() const {
    SlamMap map;
    map.keyframes = keyframes;
    map.edges = edges;
    map.solution = solution;
    return map;
  }

  std::optional<CalibratedMap> calibrate() const {
    return calibrate_slopes(read(), options, {}, {}, [] { return false; });
  }

  /// Root mean square turn between what is said and what was, from the first keyframe.
  double error_deg(const PoseGraphSolution& said) const {
    double sum2 = 0;
    for (const auto& [id, pose] : truth)
      sum2 += std::pow(gap(truth.at(0).inverse() * pose,
                           said.component_T_node.at(0).inverse() * said.component_T_node.at(id))
                           .deg,
                       2);
    return std::sqrt(sum2 / static_cast<double>(truth.size()));
  }

  double model_sigma = 1.0;
  const Field stone = bumpy_ellipsoid(5);
  const PoseGraphOptions options;
  std::vector<std::shared_ptr<const Keyframe>> keyframes;
  std::map<int, Pose> truth;
  std::vector<PoseGraphEdge> edges;
  PoseGraphSolution solution;
};

/// Slid and rolled about one place, so that it is seen all over the gel and at many tilts.
std::vector<Pose> many_looks() {
  std::vector<Pose> looks;
  for (const auto& [rx, ry, x, y] : std::vector<std::array<double, 4>>{{0, 0, 0, 0},
                                                                       {0, 0, 1.5, 0},
                                                                       {0, 4, 0.5, 1},
                                                                       {6, 0, -1, 0.5},
                                                                       {6, -6, -1.5, -1},
                                                                       {0, -6, 0, -1.2},
                                                                       {-6, 0, 1.5, -0.5},
                                                                       {-4, 5, 0.5, 0.8}})
    looks.push_back(pressed(6, 0.9) * motion(rx, ry, 0, x, y));
  return looks;
}

SlopeCorrection uneven() {
  SlopeCorrection planted;
  planted.factors[2] = -0.15;
  planted.factors[SlopeCorrection::kTermsPerAxis + 7] = 0.3;
  return planted;
}

TEST_F(CalibrateSlopes, FindsAPlantedUnevennessAndPutsPosesRight) {
  look(many_looks(), uneven());
  const std::optional<CalibratedMap> calibrated = calibrate();
  ASSERT_TRUE(calibrated);
  const CalibratedMap& map = *calibrated;
  EXPECT_NEAR(map.correction.factors[2], -0.15, 0.06);
  EXPECT_NEAR(map.correction.factors[SlopeCorrection::kTermsPerAxis + 7], 0.3, 0.12);
  EXPECT_LT(error_deg(map.solution), 0.5 * error_deg(solution));
  ASSERT_EQ(map.edges.size(), edges.size());
  ASSERT_EQ(map.keyframes.size(), keyframes.size());
  EXPECT_FALSE(map.keyframes[3]->surface == keyframes[3]->surface);
}

// As a network does that takes faint colors for bare gel.
TEST_F(CalibrateSlopes, FindsThatSmallSlopesReadFlat) {
  SlopeCorrection flat;
  constexpr std::size_t kX = SlopeCorrection::kSmallSlopes, kY = SlopeCorrection::kTermsPerAxis + kX;
  flat.factors[kX] = flat.factors[kY] = -0.5;
  look(many_looks(), flat);
  const std::optional<CalibratedMap> map = calibrate();
  ASSERT_TRUE(map);
  for (const std::size_t k : {kX, kY}) EXPECT_NEAR(map->correction.factors[k], -0.5, 0.05) << k;
  EXPECT_LT(error_deg(map->solution), 0.9 * error_deg(solution));
}

TEST_F(CalibrateSlopes, LeavesAGoodModelAlone) {
  look(many_looks(), {});
  EXPECT_FALSE(calibrate());
}

// An error 15 times as large as the model states: the loops demand a correction, the prior holds it back.
TEST_F(CalibrateSlopes, AModelThatStatesTooLittleIsCorrectedWhereLoopsDemandIt) {
  model_sigma = 0.1;
  look(many_looks(), uneven());
  const std::optional<CalibratedMap> map = calibrate();
  ASSERT_TRUE(map);
  EXPECT_LT(map->correction.factors[2], 0.0);
  EXPECT_GT(map->correction.factors[2], -0.15);
  EXPECT_LT(error_deg(map->solution), 0.8 * error_deg(solution));
}

TEST_F(CalibrateSlopes, WhatNothingTellsStaysAtThePrior) {
  look({pressed(6, 0.9), pressed(6, 0.9), pressed(6, 0.9)}, uneven());  // three looks from one place
  EXPECT_FALSE(calibrate()) << "nothing is registered again for nothing";
}

TEST_F(CalibrateSlopes, ASingleKeyframeAndATakenBackOneAreNoSpecialCase) {
  look({pressed(6, 0.9)}, {});
  keyframes.push_back(nullptr);
  EXPECT_FALSE(calibrate());
}

TEST_F(CalibrateSlopes, StoppedItLeavesEverythingAsItWas) {
  look({pressed(6, 0.9), pressed(6, 0.9) * motion(3, 0, 0, 0.5, 0)}, {});
  EXPECT_FALSE(calibrate_slopes(read(), options, {}, {}, [] { return true; }));
}

PoseGraphEdge link(int from, int to, const Pose& from_T_to) {
  return {from, to, from_T_to, Matrix6d::Identity(), EdgeKind::odometry};
}

FrameRecord frame(int keyframe, const Pose& keyframe_T_frame) {
  return {0, 0.0, TrackStatus::tracked, 0, keyframe, keyframe_T_frame};
}

TEST(ShareOutCorrections, AFrameHalfwayGetsHalfAndTheLinksEndAll) {
  std::vector<FrameRecord> frames = {frame(0, motion(0, 0, 0, 0, 0)), frame(0, motion(5.5, 0, 0, 0, 0)),
                                     frame(0, motion(11, 0, 0, 0, 0))};
  distribute_corrections({link(0, 1, motion(11, 0, 0, 0, 0))}, {link(0, 1, motion(10, 0, 0, 0, 0))}, frames);
  EXPECT_LT(gap(frames[0].keyframe_T_frame, Pose::Identity()).deg, 1e-9);
  EXPECT_LT(gap(frames[1].keyframe_T_frame, motion(5, 0, 0, 0, 0)).deg, 1e-6);
  EXPECT_LT(gap(frames[2].keyframe_T_frame, motion(10, 0, 0, 0, 0)).deg, 1e-6);
}

TEST(ShareOutCorrections, MotionsThatLeadElsewhereAndFramesWithoutALinkStay) {
  const Pose elsewhere = motion(0, 6, 0, 0, 0), after = motion(11, 0, 0, 0, 0), back = motion(-5, 0, 0, 0, 0);
  std::vector<FrameRecord> frames = {frame(0, elsewhere), frame(1, after), frame(0, back),
                                     frame(-1, Pose::Identity())};
  distribute_corrections({link(0, 1, motion(11, 0, 0, 0, 0))}, {link(0, 1, motion(10, 0, 0, 0, 0))}, frames);
  EXPECT_LT(gap(frames[0].keyframe_T_frame, elsewhere).deg, 1e-6);
  EXPECT_LT(gap(frames[1].keyframe_T_frame, after).deg, 1e-9);
  EXPECT_LT(gap(frames[2].keyframe_T_frame, back).deg, 1e-9);
}

TEST(ShareOutCorrections, OfSeveralLinksTheOneThatLeadsTheSameWayCounts) {
  std::vector<FrameRecord> frames = {frame(0, motion(5.5, 0, 0, 0, 0)), frame(0, motion(0, 4, 0, 0, 0))};
  distribute_corrections({link(0, 1, motion(0, 8, 0, 0, 0)), link(0, 2, motion(11, 0, 0, 0, 0))},
                         {link(0, 1, motion(0, 9, 0, 0, 0)), link(0, 2, motion(10, 0, 0, 0, 0))}, frames);
  EXPECT_LT(gap(frames[0].keyframe_T_frame, motion(5, 0, 0, 0, 0)).deg, 1e-6);
  EXPECT_LT(gap(frames[1].keyframe_T_frame, motion(0, 4.5, 0, 0, 0)).deg, 1e-6);
}

TEST(ShareOutCorrections, ALinkWithoutMotionAndLoopsShareNothing) {
  std::vector<FrameRecord> frames = {frame(0, motion(1, 0, 0, 0, 0))};
  PoseGraphEdge loop = link(0, 1, motion(11, 0, 0, 0, 0)), closed = link(0, 1, motion(10, 0, 0, 0, 0));
  loop.kind = closed.kind = EdgeKind::loop;
  distribute_corrections({loop}, {closed}, frames);
  distribute_corrections({link(0, 1, Pose::Identity())}, {link(0, 1, motion(1, 0, 0, 0, 0))}, frames);
  EXPECT_LT(gap(frames[0].keyframe_T_frame, motion(1, 0, 0, 0, 0)).deg, 1e-9);
}

/// The pose graph knows the linear factors from an edge alone, the sensitivity from two surfaces: the same
/// motion. Parallax makes a fifth of it, as between the sensitivity and registration itself.
TEST(SlopeFactors, ThoseOfThePoseGraphAreASubset) {
  const Eigen::Vector4d sigmas = scale_sigmas(0.1);
  const auto all_sigmas = SlopeCorrection::prior_sigma(0.1);
  for (int k = 0; k < kScaleTerms; ++k)
    EXPECT_DOUBLE_EQ(all_sigmas[SlopeCorrection::kLinear[static_cast<std::size_t>(k)]], sigmas[k]);

  const Field stone = bumpy_ellipsoid(3);
  const Pose first = pressed(6, 0.9), second = first * motion(5, -4, 4, 0.6, -0.5);
  const NormalFlowReference reference(touch(stone, first), {});
  const SurfacePtr target = touch(stone, second);
  const RegistrationResult result = register_normal_flow(reference, *target, second.inverse() * first, {});
  ASSERT_TRUE(result.ok());
  const SlopeSensitivity sensitivity = slope_sensitivity(reference, *target, result.target_T_reference, {});
  const MotionByScale of_edge = motion_by_gradient_scale(
      {0, 1, result.target_T_reference, result.information, EdgeKind::loop, result.shared_center_mm});
  for (int k = 0; k < kScaleTerms; ++k) {
    const Vector6d of_surfaces = sensitivity.pose_by_factor.col(
        static_cast<int>(SlopeCorrection::kLinear[static_cast<std::size_t>(k)]));
    EXPECT_LT((of_edge.col(k) - of_surfaces).head<3>().norm(), 0.2 * of_surfaces.head<3>().norm() + 0.01)
        << k;
  }
}

}  // namespace
}  // namespace gelslam
