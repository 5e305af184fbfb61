#include <cmath>
#include <opencv2/imgproc.hpp>

#include "../support/round_touch.hpp"
#include "scene_fixture.hpp"

namespace gelslam::test {
namespace {

using Eigen::Vector3f;

Pose at(double x, double y, double z) { return Pose(Eigen::Translation3d(x, y, z)); }

MapSnapshot chain_of_three(bool outlier) {
  MapSnapshot map;
  map.shown_component = 0;
  for (int id = 0; id < 3; ++id) {
    MapSnapshot::Node node;
    node.keyframe = id;
    node.component = 0;
    node.component_T_keyframe = at(5.0 * id - 5, 0, 0);
    map.nodes.push_back(node);
  }
  map.edges = {
      {0, 1, EdgeKind::odometry, false}, {1, 2, EdgeKind::loop, outlier}, {2, 99, EdgeKind::loop, false}};
  return map;
}

class SceneMap : public SceneDrawing {
 protected:
  void SetUp() override {
    SceneDrawing::SetUp();
    style.trajectory = style.keyframes = style.edges = style.sensor = false;
  }
  cv::Point2f pixel_of(const Vector3f& p) const {
    const Eigen::AlignedBox3f box(p - Vector3f::Ones(), p + Vector3f::Ones());
    const Eigen::Vector4f clip =
        camera.projection(kWhole.aspect(), box) * camera.camera_T_map() * p.homogeneous();
    return {(clip.x() / clip.w() + 1) / 2 * kWidth, (1 - clip.y() / clip.w()) / 2 * kHeight};
  }
};

TEST_F(SceneMap, TheTouchGlowsWhereItIs) {
  Scene scene;
  scene.set_touch({round_touch(), 1.0, {{at(3, -2, 0)}}});
  const cv::Mat3b picture = draw(scene);
  const cv::Mat1b mask = mask_of(picture);
  const cv::Moments m = cv::moments(mask, true);
  // its middle lies half a pixel of the sensor from the pose, its radius is 33 of them
  const cv::Point2f expected = pixel_of(Vector3f(3.03F, -1.97F, -0.3F));
  EXPECT_NEAR(m.m10 / m.m00 + 0.5, expected.x, 1.0);
  EXPECT_NEAR(m.m01 / m.m00 + 0.5, expected.y, 1.0);
  const double radius_px = 33 * 0.06 / static_cast<double>(camera.mm_per_px(29.7F, kWhole));
  EXPECT_NEAR(std::sqrt(m.m00 / CV_PI), radius_px, 1.5);
  const cv::Vec3b color = picture(static_cast<int>(expected.y), static_cast<int>(expected.x));
  EXPECT_GT(color[2], color[0] + 80) << "orange";
  scene.set_touch({});
  EXPECT_EQ(cv::countNonZero(mask_of(draw(scene))), 0);
}

TEST_F(SceneMap, TheTouchLiesOnTheMeshAndBehindWhatIsNearer) {
  Scene scene;
  Mesh ground = flipped(plane(-0.4, 20, 12));  // a little over the touch, as a map that is not yet right
  scene.update(changes({block(1, ground)}));
  const cv::Mat3b before = draw(scene);
  scene.set_touch({round_touch(), 1.0, {{at(0, 0, 0)}}});
  EXPECT_GT(largest_difference(draw(scene), before), 60);
  scene.update(changes({block(2, flipped(plane(-5, 20, 12)))}));
  const cv::Mat3b covered = draw(scene);
  scene.set_touch({});
  EXPECT_EQ(largest_difference(draw(scene), covered), 0);
}

TEST_F(SceneMap, DepthIsDividedByTheGain) {
  Scene scene;
  camera.look_along(Vector3f::UnitX(), -Vector3f::UnitZ());  // from the side, outside up
  camera.set_distance_mm(8);
  const auto top = [&](double gain) {
    scene.set_touch({round_touch(1.0), gain, {{at(0, 0, 0)}}});
    return cv::boundingRect(mask_of(draw(scene))).y;
  };
  // Seen edge on nothing of a flat touch shows, so it is looked at from a little above.
  camera.orbit({0, 20}, kWhole);
  EXPECT_LT(top(1.0), top(2.0) - 5);
}

TEST_F(SceneMap, TheTrajectoryRunsBetweenPosesAndNotOverGaps) {
  Scene scene;
  scene.set_trajectory({{at(-6, 0, 0), at(-2, 0, 0)}, {at(2, 0, 0), at(6, 0, 0)}, {at(0, 3, 0)}, {}});
  style.trajectory = true;
  const cv::Mat1b mask = mask_of(draw(scene));
  const auto covered = [&](double x, double y) {
    const cv::Point2f p = pixel_of(Vector3f(static_cast<float>(x), static_cast<float>(y), -0.8F));
    return cv::countNonZero(mask(cv::Rect(cvRound(p.x) - 2, cvRound(p.y) - 2, 5, 5))) > 0;
  };
  EXPECT_TRUE(covered(-4, 0));
  EXPECT_TRUE(covered(5.9, 0));
  EXPECT_FALSE(covered(0, 0)) << "tracking was lost there";
  EXPECT_FALSE(covered(0, 3));
}

TEST_F(SceneMap, LoopsAreGreenAndContradictedOnesRed) {
  Scene scene;
  style.edges = true;
  const auto color_between = [&](bool outlier) {
    scene.set_map(chain_of_three(outlier));
    const cv::Point2f p = pixel_of(Vector3f(2.5F, 0, -0.8F));
    const cv::Mat3b picture = draw(scene);
    cv::Vec3b strongest;
    for (int dy = -2; dy <= 2; ++dy) {
      const cv::Vec3b c = picture(cvRound(p.y) + dy, cvRound(p.x));
      if (cv::norm(c) > cv::norm(strongest)) strongest = c;
    }
    return strongest;
  };
  const cv::Vec3b loop = color_between(false), outlier = color_between(true);
  EXPECT_GT(loop[1], loop[2] + 40);
  EXPECT_GT(outlier[2], outlier[1] + 80);
}

}  // namespace
}  // namespace gelslam::test
