#include <gtest/gtest.h>

#include "../support/analytic_surface.hpp"
#include "gelslam/slam/refinement.hpp"
#include "gelslam/slam/slam_options.hpp"

namespace gelslam {
namespace {

using namespace test;

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

class Rejoin : public testing::Test {
 protected:
  void add(const Field& field, const Pose& object_T_sensor) {
    auto keyframe = std::make_shared<Keyframe>();
    keyframe->id = keyframe->trial = static_cast<int>(keyframes.size());
    keyframe->frame = keyframe->id;
    keyframe->surface = SurfacePtr(touch(field, object_T_sensor, everywhere()));
    keyframe->reference =
        std::make_shared<const NormalFlowReference>(keyframe->surface.get(), NormalFlowOptions{});
    FrameRecord frame;
    frame.frame = keyframe->frame;
    frame.status = keyframe->id == 0 ? TrackStatus::tracked : TrackStatus::lost;
    frame.trial = frame.keyframe = keyframe->id;
    frames.push_back(frame);
    truth.push_back(object_T_sensor);
    keyframes.push_back(std::move(keyframe));
  }
  std::vector<PoseGraphEdge> loops() const {
    return rejoin_broken_trials({.parts = parts, .keyframes = keyframes, .frames = frames}, options);
  }

  SlamOptions options;
  std::vector<std::shared_ptr<const Keyframe>> keyframes;
  std::vector<FrameRecord> frames;
  std::vector<ScanPart> parts;
  std::vector<Pose> truth;
};

TEST_F(Rejoin, FindsTheNewTrialsPlaceOnTheOld) {
  add(textured_plane(1), motion(0, 0, 0, 0, 0, 0.4));
  add(textured_plane(1), motion(2, 0, 4, 2.5, 1, 0.4));
  const auto found = loops();
  ASSERT_EQ(found.size(), 1U);
  EXPECT_LT(gap(found.front().from_T_to, truth[0].inverse() * truth[1]).mm, 0.05);
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
  ASSERT_GT(gap(wrong->from_T_to, truth[0].inverse() * truth[1]).deg, 10);
  EXPECT_TRUE(loops().empty());
}

}  // namespace
}  // namespace gelslam
