#include <cstdint>
#include <limits>
#include <opencv2/imgproc.hpp>
#include <random>
#include <vector>

#include "scene_fixture.hpp"

namespace gelslam::test {
namespace {

using Eigen::Vector3f;

constexpr float kNan = std::numeric_limits<float>::quiet_NaN();

class ScenePicture : public SceneDrawing {};

double brightness(const cv::Vec3b& c) { return (c[0] + c[1] + c[2]) / 3.0; }

/// Pixels inside the second mask only, further than `margin_px` from the first.
int strays(const cv::Mat1b& first, const cv::Mat1b& second, int margin_px) {
  cv::Mat1b near;
  const cv::Size size(2 * margin_px + 1, 2 * margin_px + 1);
  cv::dilate(first, near, cv::getStructuringElement(cv::MORPH_ELLIPSE, size));
  return cv::countNonZero(second & ~near);
}

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
  both.update(std::vector{block(1, near), block(2, far)});
  reversed.update(std::vector{block(2, far), block(1, near)});
  // The far one behind the eye: texture is drawn the stronger, the smoother the whole mesh is.
  only_near.update(std::vector{block(1, near), block(2, moved(far, {0, 0, -200}))});
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
  expected.update(std::vector{block(7, right)});
  scene.update(std::vector{block(7, left)});
  EXPECT_GT(largest_difference(draw(scene), draw(expected)), 50);
  scene.update(std::vector{block(7, right)});
  EXPECT_EQ(largest_difference(draw(scene), draw(expected)), 0);
  scene.update(std::vector{block(7, Mesh())});
  EXPECT_EQ(largest_difference(draw(scene), draw(empty)), 0);
  EXPECT_TRUE(scene.bounds_mm().isEmpty());
  scene.update(std::vector{block(7, left), block(8, right)});
  scene.update(MeshChanges{true, {block(9, right)}});
  EXPECT_EQ(largest_difference(draw(scene), draw(expected)), 0) << "cleared first";
}

TEST_F(ScenePicture, ManyUpdatesEndWhereTheLastOnesSay) {
  std::mt19937 random(11);
  Scene scene, fresh;
  std::vector<MeshBlock> last(12);
  for (int i = 0; i < 400; ++i) {
    const auto key = static_cast<std::int64_t>(random() % last.size());
    const float x = static_cast<float>(random() % 200) / 20 - 5,
                y = static_cast<float>(random() % 120) / 20 - 3;
    Mesh mesh =
        random() % 5 == 0 ? Mesh() : moved(sphere(0.8, 8 + 4 * static_cast<int>(random() % 8)), {x, y, 0});
    last[static_cast<std::size_t>(key)] = block(key, std::move(mesh));
    scene.update(std::span(&last[static_cast<std::size_t>(key)], 1));
    if (i % 7 == 0) draw(scene);
  }
  for (std::size_t key = 0; key < last.size(); ++key) last[key].key = static_cast<std::int64_t>(key);
  fresh.update(last);
  EXPECT_EQ(largest_difference(draw(scene), draw(fresh)), 0);
}

TEST_F(ScenePicture, AFineMeshHasTheSameOutline) {
  Scene scene, small;
  scene.set_mesh(sphere(5, 360));
  small.set_mesh(sphere(5, 240));
  const cv::Mat1b large_mask = mask_of(draw(scene)), small_mask = mask_of(draw(small));
  EXPECT_EQ(strays(small_mask, large_mask, 1) + strays(large_mask, small_mask, 1), 0);
}

TEST_F(ScenePicture, HostileMeshesDrawWhatIsGood) {
  Mesh bad = sphere(3, 48);
  Scene good, hostile;
  good.set_mesh(bad);
  bad.confidence.assign(bad.vertices_mm.size(), kNan);
  bad.vertices_mm.push_back({kNan, 0, 0});
  bad.vertices_mm.push_back({3e38F, 3e38F, -3e38F});
  bad.confidence.resize(bad.vertices_mm.size());
  const int last = static_cast<int>(bad.vertices_mm.size()) - 1;
  bad.triangles.emplace_back(0, 1, last);
  bad.triangles.emplace_back(0, 1, last - 1);
  bad.triangles.emplace_back(0, 1, last + 1);
  bad.triangles.emplace_back(-1, 1, 2);
  hostile.set_mesh(bad);
  const cv::Mat3b expected = draw(good);
  EXPECT_EQ(largest_difference(draw(hostile), expected), 0);
  Scene by_block;
  by_block.update(std::vector{block(-5, bad)});
  EXPECT_EQ(cv::countNonZero(mask_of(draw(by_block)) != mask_of(expected)), 0);
  Scene empty;
  empty.set_mesh(Mesh());
  EXPECT_EQ(cv::countNonZero(mask_of(draw(empty))), 0);
  EXPECT_FALSE(empty.pick(camera.pick_ray({240, 180}, kWhole)));
}

TEST_F(ScenePicture, PickMeetsTheNearSide) {
  Scene scene;
  scene.set_mesh(sphere(5, 256));
  const auto hit = scene.pick(camera.pick_ray({kWidth / 2.0F, kHeight / 2.0F}, kWhole));
  ASSERT_TRUE(hit);
  EXPECT_LT((*hit - Vector3f(0, 0, -5)).norm(), 0.01F);
  EXPECT_FALSE(scene.pick(camera.pick_ray({2, 2}, kWhole)));
}

TEST_F(ScenePicture, OnlyItsOwnPartOfTheFramebufferIsTouched) {
  Scene scene, nothing;
  scene.set_mesh(sphere(5, 64));
  RenderTarget target(kWidth, kHeight);
  target.bind();
  scene.draw(camera, kWhole, style);
  const cv::Mat3b before = target.read();
  nothing.draw(camera, {0, 0, kWidth / 2, kHeight}, style);
  const cv::Mat3b after = target.read();
  EXPECT_EQ(largest_difference(before.colRange(kWidth / 2, kWidth), after.colRange(kWidth / 2, kWidth)), 0);
  EXPECT_LT(brightness(after(kHeight / 2, kWidth / 2 - 20)),
            brightness(before(kHeight / 2, kWidth / 2 - 20)) - 50);
}

TEST_F(ScenePicture, ImpossiblePicturesAreRefused) {
  EXPECT_THROW(RenderTarget(0, 100), Error);
  EXPECT_THROW(RenderTarget(100, -1), Error);
  EXPECT_THROW(RenderTarget(RenderTarget::kMaxSidePx + 1, 10), Error);
}

}  // namespace
}  // namespace gelslam::test
