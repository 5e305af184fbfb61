// Tests overlap edges: loops between overlapping keyframes, which are searched when the scan has ended.
#include <gtest/gtest.h>

#include "../support/analytic_surface.hpp"
#include "gelslam/slam/refinement.hpp"
#include "gelslam/slam/slam_options.hpp"

namespace gelslam::test {
namespace {

/// Keyframes at known poses on an object, and a solution of the pose graph in which these poses have small
/// errors.
class OverlapEdges : public testing::Test {
 protected:
  void add(const Pose& texture_T_keyframe, const Pose& error = Pose::Identity()) {
    auto keyframe = std::make_shared<Keyframe>();
    keyframe->id = static_cast<int>(keyframes.size());
    keyframe->surface = SurfacePtr(touch(texture, texture_T_keyframe, everywhere()));
    keyframe->reference =
        std::make_shared<const NormalFlowReference>(keyframe->surface.get(), NormalFlowOptions{});
    truth.push_back(texture_T_keyframe);
    keyframes.push_back(keyframe);
    solution.component_T_node[keyframe->id] = texture_T_keyframe * error;
    solution.component_of_node[keyframe->id] = 0;
  }
  std::vector<PoseGraphEdge> found() const { return find_overlap_edges(keyframes, solution, edges, options); }
  PoseGap error_of(const PoseGraphEdge& loop) const {
    const auto pose = [&](int id) { return truth[static_cast<std::size_t>(id)]; };
    return gap(loop.from_T_to, pose(loop.from).inverse() * pose(loop.to));
  }

  std::vector<std::shared_ptr<const Keyframe>> keyframes;
  std::vector<Pose> truth;
  SlamOptions options;
  Field texture = textured_plane(1);
  PoseGraphSolution solution;
  std::vector<PoseGraphEdge> edges;
};

const Pose kFirst = motion(0, 0, 0, 0, 0, 0.4), kNear = motion(1, 0, 20, 3, 1, 0.4),
           kFar = motion(0, 0, 0, 30, 0, 0.4);
const Pose kWrong = motion(0.5, -0.3, 1, 0.15, -0.1);

TEST_F(OverlapEdges, RegistersAnOverlapThatHasNoEdge) {
  add(kFirst);
  add(kNear, kWrong);
  add(kFar);
  const std::vector<PoseGraphEdge> loops = found();
  ASSERT_EQ(loops.size(), 1u);
  EXPECT_EQ(loops[0].from, 0);
  EXPECT_EQ(loops[0].to, 1);
  EXPECT_EQ(loops[0].kind, EdgeKind::loop);
  // The limits are the errors of a single registration.
  expect_within(error_of(loops[0]), 0.03, 0.01);
  EXPECT_GT(loops[0].information(0, 0), 0);
}

TEST_F(OverlapEdges, DoesNotLinkAPatch) {
  add(kFirst);
  add(kNear, kWrong);
  auto patch = std::make_shared<Keyframe>(*keyframes[1]);
  patch->is_patch = true;
  keyframes[1] = patch;
  EXPECT_TRUE(found().empty());
}

TEST_F(OverlapEdges, DoesNotLinkOppositeSidesOfAThinObject) {
  add(kFirst);
  add(kFirst);
  Pose behind = Pose::Identity();
  behind.linear() = so3_exp({M_PI, 0, 0});
  solution.component_T_node[1] = solution.component_T_node[0] * behind;
  EXPECT_TRUE(found().empty());
}

TEST_F(OverlapEdges, ABelievedOverlapThatIsNoneGivesNoEdge) {
  add(kFirst);
  add(kFar);
  solution.component_T_node[1] = solution.component_T_node[0];  // a false loop put it here
  EXPECT_TRUE(found().empty());
}

// The object is a grid of bumps at distances of 1.6 mm. The pose with its drift is nearer to the next bump
// than to the right one, so a registration would converge there.
TEST_F(OverlapEdges, ARepeatedPatternIsLinkedOnlyWhereThePlaceIsKnownBeforehand) {
  const double k = 2 * M_PI / 1.6;
  texture = relief({{{k * Eigen::Vector3d::UnitX(), 0, 0.04}, {k * Eigen::Vector3d::UnitY(), 0, 0.04}}});
  add(kFirst);
  add(motion(0, 0, 0, 1, 0.3, 0.4));
  add(motion(0, 0, 0, 2.4, 0.5, 0.4), motion(0, 0, 0, 1.5, 0));
  Matrix6d good = Matrix6d::Identity() * 1e4, drifting = Matrix6d::Identity();
  edges = {{0, 1, truth[0].inverse() * truth[1], good, EdgeKind::odometry},
           {1, 2, truth[1].inverse() * truth[2], drifting, EdgeKind::odometry}};
  solution.edge_outlier.assign(2, false);
  EXPECT_TRUE(found().empty());
  edges.push_back({0, 2, truth[0].inverse() * solution.component_T_node[2], good, EdgeKind::loop});
  solution.edge_outlier.push_back(true);  // an outlier has no information
  EXPECT_TRUE(found().empty());
  edges.pop_back();
  solution.edge_outlier.pop_back();
  options.verification.max_self_similarity = 1.0;
  const std::vector<PoseGraphEdge> misled = found();
  options = {};
  ASSERT_EQ(misled.size(), 1u);
  EXPECT_GT(error_of(misled[0]).mm, 1.0);

  solution.component_T_node[2] = truth[2];
  edges[1].information = good;
  const std::vector<PoseGraphEdge> loops = found();
  ASSERT_EQ(loops.size(), 1u);
  EXPECT_LT(error_of(loops[0]).mm, 0.05);
}

TEST_F(OverlapEdges, TakesTheLargestOverlapsWhenThereAreTooMany) {
  add(motion(0, 0, 0, 5, 0, 0.4));
  add(motion(0, 0, 0, 1, 0, 0.4));
  add(motion(0, 0, 0, 3, 0, 0.4));
  add(kFirst);
  edges = {{0, 1, Pose::Identity(), Matrix6d::Identity(), EdgeKind::odometry},
           {0, 2, Pose::Identity(), Matrix6d::Identity(), EdgeKind::odometry},
           {1, 2, Pose::Identity(), Matrix6d::Identity(), EdgeKind::odometry}};
  solution.edge_outlier.assign(3, false);
  options.refinement.max_pairs_per_keyframe = 1;
  const std::vector<PoseGraphEdge> loops = found();
  ASSERT_EQ(loops.size(), 1u);
  EXPECT_EQ(loops[0].from, 1);
  EXPECT_EQ(loops[0].to, 3);
}

}  // namespace
}  // namespace gelslam::test
