#include "live/unjoined_preview.hpp"

#include <gtest/gtest.h>

#include "../support/round_touch.hpp"

namespace gelslam::viewer::detail {
namespace {

Pose at(double x, double y, double z) { return Pose(Eigen::Translation3d(x, y, z)); }

/// Two keyframes of the map, two of a trial that is not joined to it, 1 mm apart.
class UnjoinedPreviewTest : public testing::Test {
 protected:
  UnjoinedPreviewTest() {
    map_.shown_component = 0;
    for (int id = 0; id < 4; ++id) {
      MapSnapshot::Node node;
      node.keyframe = id;
      node.trial = id / 2;
      node.component = id < 2 ? 0 : 2;
      node.component_T_keyframe = at(id % 2, 0, 0);
      node.surface = StoredSurface(test::round_touch());
      map_.nodes.push_back(node);
    }
    touch(3);
  }
  void touch(int id) {
    auto keyframe = std::make_shared<Keyframe>();
    keyframe->id = id;
    auto touch = std::make_shared<FrameReport>();
    touch->surface = test::round_touch();
    touch->tracked.status = TrackStatus::tracked;
    touch->tracked.keyframe = std::move(keyframe);
    touch->tracked.keyframe_T_frame = at(0, 0.5, 0);
    touch_ = touch;
  }
  bool follow() {
    return unjoined_.follow(map_, touch_.get(),
                            touch_ ? map_.pose_of(record_of(touch_->tracked)) : std::nullopt);
  }

  MapSnapshot map_;
  std::shared_ptr<const FrameReport> touch_;
  UnjoinedPreview unjoined_;
  const Eigen::AlignedBox3f box_{Eigen::Vector3f(-5, -5, -1), Eigen::Vector3f(5, 5, 1)};
};

TEST_F(UnjoinedPreviewTest, GrowsBesideTheMap) {
  EXPECT_TRUE(follow());
  ASSERT_TRUE(unjoined_.is_apart());
  unjoined_.place_beside(box_, OrbitCamera());
  ASSERT_TRUE(unjoined_.is_shown());
  EXPECT_FALSE(unjoined_.box_mm().intersects(box_)) << "beside it";
  EXPECT_GT(unjoined_.box_mm().min().x(), 5) << "to its right as the camera sees it";
  const auto touch = unjoined_.map_T_touch();
  ASSERT_TRUE(touch);
  EXPECT_TRUE((unjoined_.map_T_unjoined()->inverse() * *touch).isApprox(at(1, 0.5, 0), 1e-9))
      << "anchor is keyframe 2";
  EXPECT_FALSE(follow()) << "nothing new";
  const std::size_t vertices = unjoined_.mesh().vertices.size();
  map_.nodes.push_back(map_.nodes.back());
  map_.nodes.back().keyframe = 4;
  map_.nodes.back().component_T_keyframe = at(2, 0, 0);
  EXPECT_TRUE(follow());
  EXPECT_EQ(2 * unjoined_.mesh().vertices.size(), 3 * vertices) << "three keyframes instead of two";
}

TEST_F(UnjoinedPreviewTest, GoesWhenItIsTakenBack) {
  follow();
  unjoined_.place_beside(box_, OrbitCamera());
  map_.nodes.resize(2);
  touch_ = nullptr;
  follow();
  EXPECT_FALSE(unjoined_.is_shown());
}

}  // namespace
}  // namespace gelslam::viewer::detail
