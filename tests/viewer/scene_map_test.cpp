#include <cmath>
#include <limits>
#include <opencv2/imgproc.hpp>
#include <vector>

#include "../support/round_touch.hpp"
#include "scene/touch_mesh.hpp"
#include "scene_fixture.hpp"

namespace gelslam::test {
namespace {

using Eigen::Vector3d;
using Eigen::Vector3f;

Pose at(double x, double y, double z) {
  Pose pose = Pose::Identity();
  pose.translation() = Vector3d(x, y, z);
  return pose;
}

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
  scene.set_touch(TouchPatch{round_touch(), at(3, -2, 0), 1.0});
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
  scene.set_touch(std::nullopt);
  EXPECT_EQ(cv::countNonZero(mask_of(draw(scene))), 0);
}

TEST_F(SceneMap, TheTouchLiesOnTheMeshAndBehindWhatIsNearer) {
  Scene scene;
  const Pose pose = at(0, 0, 0);
  Mesh ground = flipped(plane(-0.4, 20, 12));  // a little over the touch, as a map that is not yet right
  scene.update(std::vector{block(1, ground)});
  const cv::Mat3b before = draw(scene);
  scene.set_touch(TouchPatch{round_touch(), pose, 1.0});
  EXPECT_GT(largest_difference(draw(scene), before), 60);
  scene.update(std::vector{block(2, flipped(plane(-5, 20, 12)))});
  const cv::Mat3b covered = draw(scene);
  scene.set_touch(std::nullopt);
  EXPECT_EQ(largest_difference(draw(scene), covered), 0);
}

TEST_F(SceneMap, TheTouchIsSeenFromOutsideOnly) {
  Scene scene;
  scene.set_touch(TouchPatch{round_touch(), at(0, 0, 0), 1.0});
  camera.look_along(-Vector3f::UnitZ(), Vector3f::UnitY());
  EXPECT_EQ(cv::countNonZero(mask_of(draw(scene))), 0);
}

TEST_F(SceneMap, DepthIsDividedByTheGain) {
  Scene scene;
  camera.look_along(Vector3f::UnitX(), -Vector3f::UnitZ());  // from the side, outside up
  camera.set_distance_mm(8);
  style.sensor = true;
  const auto top = [&](double gain) {
    auto bump = std::make_shared<Surface>(*round_touch(1.0));
    scene.set_touch(TouchPatch{bump, at(0, 0, 0), gain});
    style.sensor = false;
    return cv::boundingRect(mask_of(draw(scene))).y;
  };
  // Seen edge on nothing of a flat touch shows, so it is looked at from a little above.
  camera.orbit({0, 20}, kWhole);
  EXPECT_LT(top(1.0), top(2.0) - 5);
}

TEST_F(SceneMap, DamagedTouchesDrawNothing) {
  Scene scene;
  auto without_normals = std::make_shared<Surface>(*round_touch());
  without_normals->normals.release();
  auto nan = std::make_shared<Surface>(*round_touch());
  nan->height_mm = cv::Mat1f(nan->contact.size(), std::numeric_limits<float>::quiet_NaN());
  Pose lost = at(0, 0, 0);
  lost.translation().x() = std::nan("");
  for (const TouchPatch& touch :
       {TouchPatch{nullptr, at(0, 0, 0), 1.0}, TouchPatch{without_normals, at(0, 0, 0), 1.0},
        TouchPatch{nan, at(0, 0, 0), 1.0}, TouchPatch{round_touch(), lost, 1.0}}) {
    scene.set_touch(touch);
    EXPECT_EQ(cv::countNonZero(mask_of(draw(scene))), 0);
  }
}

TEST_F(SceneMap, TheSensorsOutlineIsItsFieldOfView) {
  Scene scene;
  scene.set_touch(TouchPatch{round_touch(), at(0, 0, 0), 1.0});
  style.sensor = true;
  const cv::Rect box = cv::boundingRect(mask_of(draw(scene)));
  const float mm = camera.mm_per_px(30, kWhole);
  EXPECT_NEAR(static_cast<float>(box.width), 9.6F / mm, 4);  // the line is 2 px wide
  EXPECT_NEAR(static_cast<float>(box.height), 7.2F / mm, 4);
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

TEST_F(SceneMap, LinesBehindTheObjectAreFaint) {
  Scene scene;
  scene.set_mesh(flipped(plane(-3, 20, 8)));
  const cv::Mat3b without = draw(scene);
  scene.set_trajectory({{at(-8, 0, 0), at(8, 0, 0)}});
  style.trajectory = true;
  const cv::Mat3b with = draw(scene);
  const auto change = [&](float x) {
    const cv::Point2f p = pixel_of(Vector3f(x, 0, -0.8F));
    const cv::Rect around(cvRound(p.x), cvRound(p.y) - 2, 1, 5);
    return cv::norm(with(around), without(around), cv::NORM_INF);
  };
  EXPECT_GT(change(6.5F), 80) << "in the open";
  EXPECT_GT(change(0), 4) << "through the object";
  EXPECT_LT(change(0), 45);
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

TEST_F(SceneMap, KeyframesOfOtherComponentsAreNotShown) {
  Scene scene;
  style.keyframes = true;
  MapSnapshot map = chain_of_three(false);
  scene.set_map(map);
  EXPECT_GT(cv::countNonZero(mask_of(draw(scene))), 50);
  map.shown_component = 1;
  scene.set_map(map);
  EXPECT_EQ(cv::countNonZero(mask_of(draw(scene))), 0);
}

TEST(TouchMesh, AContactOfBlocksEndsInARoundLine) {
  constexpr int side = 80, first = 20, last = 59;  // of a square of pixels
  auto surface = std::make_shared<Surface>();
  surface->pixel_pitch_mm = 1;
  surface->height_mm = cv::Mat1f(side, side, 0.0F);
  surface->normals = cv::Mat3f(side, side, cv::Vec3f(0, 0, 1));
  surface->contact = cv::Mat1b(side, side, uchar{0});
  surface->contact(cv::Range(first, last + 1), cv::Range(first, last + 1)) = 255;
  surface->contact_pixels = cv::countNonZero(surface->contact);
  cv::Mat1f inside(side, side, -1.0F);
  for (const viewer::detail::TouchMesh::Vertex& v :
       viewer::detail::make_touch_mesh({surface, Pose::Identity(), 1.0}).vertices)
    inside(cvRound(v.position_mm.y() + 0.5F * side - 0.5F), cvRound(v.position_mm.x() + 0.5F * side - 0.5F)) =
        v.inside;
  for (const int corner : {first, last}) {
    EXPECT_LT(inside(corner, corner), 0);
    EXPECT_GT(inside(corner, side / 2), 0) << "sides stay where they are";
  }
  EXPECT_LT(inside(first - 2, side / 2), 0);
  EXPECT_NEAR(inside(side / 2, side / 2), 1, 1e-3);
}

}  // namespace
}  // namespace gelslam::test
