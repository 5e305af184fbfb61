#include <opencv2/imgproc.hpp>

#include "scene_fixture.hpp"

namespace gelslam::test {
namespace {

using Eigen::Vector3f;

class ScenePicture : public SceneDrawing {};

double brightness(const cv::Vec3b& c) { return (c[0] + c[1] + c[2]) / 3.0; }

TEST_F(ScenePicture, OutlineOfABallIsTheAnalyticOne) {
  Scene scene;
  scene.set_mesh(sphere(5, 256));
  const cv::Mat1b mask = mask_of(draw(scene));
  const cv::Moments m = cv::moments(mask, true);
  EXPECT_NEAR(m.m10 / m.m00, kWidth / 2.0 - 0.5, 0.5);
  EXPECT_NEAR(m.m01 / m.m00, kHeight / 2.0 - 0.5, 0.5);
  EXPECT_NEAR(std::sqrt(m.m00 / CV_PI), outline_px(5), 1.0);
  const cv::Rect box = cv::boundingRect(mask);
  EXPECT_NEAR(box.width, 2 * outline_px(5), 2.5);
  EXPECT_NEAR(box.height, 2 * outline_px(5), 2.5);
}

TEST_F(ScenePicture, LightComesFromUpperLeftWhereverTheViewerIs) {
  for (const SceneShading shading : {SceneShading::clay, SceneShading::curvature}) {
    style.shading = shading;
    Scene scene;
    scene.set_mesh(sphere(5, 128));
    const cv::Mat3b front = draw(scene);
    const int step = static_cast<int>(outline_px(5) * 0.5F);
    const auto at = [&](int dx, int dy) {
      return brightness(front(kHeight / 2 + dy * step, kWidth / 2 + dx * step));
    };
    EXPECT_GT(at(-1, -1), at(1, 1) + 30) << static_cast<int>(shading);
    EXPECT_GT(at(-1, -1), at(0, 1) + 10);
    const OrbitCamera kept = camera;
    camera.look_along(Vector3f(0.5F, 0.6F, -0.3F), Vector3f(0, 1, 1));
    // A ball looks the same from everywhere but for the 1.5 mm facets and 10-bit normals.
    EXPECT_LT(cv::norm(draw(scene), front, cv::NORM_L1) / (3.0 * kWidth * kHeight), 0.5);
    camera = kept;
  }
}

TEST_F(ScenePicture, NearHidesFarInAnyOrder) {
  const Mesh near = moved(sphere(1.5, 64), {1, 0.5F, -8}), far = sphere(5, 64);
  Scene both, reversed, only_near;
  both.update(changes({block(1, near), block(2, far)}));
  reversed.update(changes({block(2, far), block(1, near)}));
  // The far one behind the eye: texture is drawn the stronger, the smoother the whole mesh is.
  only_near.update(changes({block(1, near), block(2, moved(far, {0, 0, -200}))}));
  const cv::Mat3b picture = draw(both), alone = draw(only_near);
  cv::Mat1b inside;
  cv::erode(mask_of(alone), inside, cv::Mat(), {-1, -1}, 2);
  ASSERT_GT(cv::countNonZero(inside), 500);
  cv::Mat difference;
  cv::absdiff(picture, alone, difference);
  difference.setTo(cv::Scalar::all(0), inside == 0);
  EXPECT_LE(cv::norm(difference, cv::NORM_INF), 2) << "curvature is rounded 200 mm away";
  EXPECT_EQ(largest_difference(picture, draw(reversed)), 0);
}

TEST_F(ScenePicture, InsidesAreGray) {
  style.color = SceneColor::height;
  Scene outside, inside;
  outside.set_mesh(sphere(5, 64));
  inside.set_mesh(flipped(sphere(5, 64)));
  const auto saturation = [&](Scene& scene) {
    const cv::Vec3b c = draw(scene)(kHeight / 2, kWidth / 2);
    return *std::max_element(c.val, c.val + 3) - *std::min_element(c.val, c.val + 3);
  };
  EXPECT_GT(saturation(outside), 60);
  EXPECT_LT(saturation(inside), 25);
}

TEST_F(ScenePicture, AnUpdateReplacesAndAnEmptyOneRemoves) {
  const Mesh left = moved(sphere(2, 48), {-4, 0, 0}), right = moved(sphere(2, 48), {4, 0, 0});
  Scene scene, expected, empty;
  expected.update(changes({block(7, right)}));
  scene.update(changes({block(7, left)}));
  EXPECT_GT(largest_difference(draw(scene), draw(expected)), 50);
  scene.update(changes({block(7, right)}));
  EXPECT_EQ(largest_difference(draw(scene), draw(expected)), 0);
  scene.update(changes({block(7, Mesh())}));
  EXPECT_EQ(largest_difference(draw(scene), draw(empty)), 0);
  EXPECT_TRUE(scene.bounds_mm().isEmpty());
  scene.update(changes({block(7, left), block(8, right)}));
  scene.update(changes({block(9, right)}, /*cleared=*/true));
  EXPECT_EQ(largest_difference(draw(scene), draw(expected)), 0) << "cleared first";
}

}  // namespace
}  // namespace gelslam::test
