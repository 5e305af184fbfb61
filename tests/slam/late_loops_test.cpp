// Loops that are looked for once the scan has ended: between keyframes that overlap, and between trials.
#include <gtest/gtest.h>

#include "../support/analytic_surface.hpp"
#include "gelslam/slam/refinement.hpp"
#include "gelslam/slam/slam_options.hpp"

namespace gelslam::test {
namespace {

/// Keyframes at known places of an object.
class Keyframes : public testing::Test {
 protected:
  Keyframe& touched(const Field& field, const Pose& object_T_keyframe) {
    auto keyframe = std::make_shared<Keyframe>();
    keyframe->id = static_cast<int>(keyframes.size());
    keyframe->surface = SurfacePtr(touch(field, object_T_keyframe, everywhere()));
    keyframe->reference =
        std::make_shared<const NormalFlowReference>(keyframe->surface.get(), NormalFlowOptions{});
    truth.push_back(object_T_keyframe);
    keyframes.push_back(keyframe);
    return *keyframe;
  }
  PoseGap error_of(const PoseGraphEdge& loop) const {
    const auto pose = [&](int id) { return truth[static_cast<std::size_t>(id)]; };
    return gap(loop.from_T_to, pose(loop.from).inverse() * pose(loop.to));
  }

  std::vector<std::shared_ptr<const Keyframe>> keyframes;
  std::vector<Pose> truth;
  SlamOptions options;
};

/// And a pose graph's solution that has them a little wrong.
class OverlapEdges : public Keyframes {
 protected:
  void add(const Pose& texture_T_keyframe, const Pose& error = Pose::Identity()) {
    const int id = touched(texture, texture_T_keyframe).id;
    solution.component_T_node[id] = texture_T_keyframe * error;
    solution.component_of_node[id] = 0;
  }
  std::vector<PoseGraphEdge> found() const { return find_overlap_edges(keyframes, solution, edges, options); }

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
  // as single registrations
  expect_within(error_of(loops[0]), 0.03, 0.01);
  EXPECT_GT(loops[0].information(0, 0), 0);
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

// A grid of bumps 1.6 mm apart: the drifted pose is nearer to the next bump than to the right one, and
// registration would settle there.
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
  solution.edge_outlier.push_back(true);  // tells nothing
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

/// Beads round a rim of 10 mm radius whose middle lies beyond the picture, as on a coin: turned by one bead
/// about that middle it is the same again, shifted it is not.
constexpr double kRimMm = 10, kBeads = 20;
Field rim() {
  return [](const Eigen::Vector3d& p) {
    const double x = p.x(), y = p.y() + kRimMm, r = std::hypot(x, y), phi = std::atan2(x, y),
                 off = r - kRimMm;
    const double ring = 0.12 * std::exp(-0.5 * off * off / (0.7 * 0.7)), wave = std::cos(kBeads * phi);
    const double by_r = -ring * off / (0.7 * 0.7) * (1 + wave),
                 by_phi = -ring * kBeads * std::sin(kBeads * phi);
    return std::pair{p.z() + ring * (1 + wave), Eigen::Vector3d(by_r * x / r + by_phi * y / (r * r),
                                                                by_r * y / r - by_phi * x / (r * r), 1)};
  };
}

/// rim_T_sensor, gone round the rim by so many beads.
Pose round_the_rim(double beads) {
  const Eigen::Translation3d middle(0, -kRimMm, 0);
  return middle * Eigen::AngleAxisd(beads * 2 * M_PI / kBeads, Eigen::Vector3d::UnitZ()) * middle.inverse() *
         motion(0, 0, 0, 0, 0, 0.3);
}

class Rejoin : public Keyframes {
 protected:
  void add(const Field& field, const Pose& object_T_sensor) {
    Keyframe& keyframe = touched(field, object_T_sensor);
    keyframe.frame = keyframe.trial = keyframe.id;
    frames.push_back({.frame = keyframe.id,
                      .status = keyframe.id == 0 ? TrackStatus::tracked : TrackStatus::lost,
                      .trial = keyframe.id,
                      .keyframe = keyframe.id});
  }
  std::vector<PoseGraphEdge> loops() const {
    return rejoin_broken_trials({.parts = parts, .keyframes = keyframes, .frames = frames}, options);
  }

  std::vector<FrameRecord> frames;
  std::vector<ScanPart> parts;
};

TEST_F(Rejoin, FindsTheNewTrialsPlaceOnTheOld) {
  add(textured_plane(1), motion(0, 0, 0, 0, 0, 0.4));
  add(textured_plane(1), motion(2, 0, 4, 2.5, 1, 0.4));
  const auto found = loops();
  ASSERT_EQ(found.size(), 1U);
  EXPECT_LT(error_of(found.front()).mm, 0.05);
}

TEST_F(Rejoin, PartsAreBoundaries) {
  add(textured_plane(1), motion(0, 0, 0, 0, 0, 0.4));
  add(textured_plane(1), motion(2, 0, 4, 2.5, 1, 0.4));
  parts = {{0, "one", 1, ""}, {1, "one", 1, ""}};
  EXPECT_TRUE(loops().empty());
}

TEST_F(Rejoin, DoesNotTakeTheNextBeadForThisOne) {
  add(rim(), round_the_rim(0));
  add(rim(), round_the_rim(0.7));
  ASSERT_LT(keyframes[1]->reference->self_similarity(), options.verification.max_self_similarity);
  const auto wrong = verify_loop(*keyframes[0], *keyframes[1], Pose::Identity(), {}, {});
  ASSERT_TRUE(wrong) << "verification alone sees it";
  ASSERT_GT(error_of(*wrong).deg, 10);
  EXPECT_TRUE(loops().empty());
}

}  // namespace
}  // namespace gelslam::test
