#include <algorithm>
#include <numbers>
#include <vector>

#include "scene_fixture.hpp"

namespace gelslam::test {
namespace {

using Eigen::Vector3d;
using Eigen::Vector3f;

class SceneColors : public SceneDrawing {
 protected:
  /// Where on a color map a lit pixel comes from, by its hue alone: 0 to 1. Light is nearly white.
  double place_on_map(const cv::Vec3b& pixel, const Scene& scene) const {
    const auto chromaticity = [](double r, double g, double b) {
      const Vector3d linear(std::pow(r / 255, 2.2), std::pow(g / 255, 2.2), std::pow(b / 255, 2.2));
      return Vector3d(linear / std::max(linear.sum(), 1e-6));
    };
    const Vector3d seen = chromaticity(pixel[2], pixel[1], pixel[0]);
    const auto map = scene.legend(style)->colors_rgb;
    double best = 0, nearest = 1e9;
    for (std::size_t i = 0; i < map.size(); ++i) {
      const double distance = (chromaticity(map[i][0], map[i][1], map[i][2]) - seen).norm();
      if (distance < nearest) nearest = distance, best = static_cast<double>(i) / 255;
    }
    return best;
  }

  /// The point of a ball about the origin under a pixel.
  std::optional<Vector3f> on_ball(float radius, int x, int y) const {
    const PickRay ray = camera.pick_ray({static_cast<float>(x) + 0.5F, static_cast<float>(y) + 0.5F}, kWhole);
    const float along = -ray.origin_mm.dot(ray.direction);
    const float inside = radius * radius - (ray.origin_mm + along * ray.direction).squaredNorm();
    if (inside < 0) return std::nullopt;
    return ray.origin_mm + (along - std::sqrt(inside)) * ray.direction;
  }
};

TEST_F(SceneColors, DistanceToAShiftedBallIsReadOffTheColors) {
  const Vector3f shift(0.5F, 0.2F, 0);
  const auto distance = [&](const Vector3f& p) { return std::abs((p - shift).norm() - 5); };
  Scene scene;
  const Mesh ball = sphere(5, 200);
  std::vector<float> distances;
  for (const Vector3f& p : ball.vertices_mm) distances.push_back(distance(p));
  scene.set_mesh(ball, distances);
  style.color = SceneColor::distance;
  style.range = {0.0F, 0.6F};
  const cv::Mat3b picture = draw(scene);
  std::vector<double> errors;
  for (int y = 0; y < kHeight; y += 7) {
    for (int x = 0; x < kWidth; x += 7) {
      const auto p = on_ball(5, x, y);
      if (!p || p->z() > -2.5F) continue;  // not at the rim, where the light is poor
      const double expected = distance(*p) / 0.6;
      errors.push_back(std::abs(place_on_map(picture(y, x), scene) - expected));
    }
  }
  ASSERT_GT(errors.size(), 80U);
  std::sort(errors.begin(), errors.end());
  EXPECT_LT(errors[errors.size() / 2], 0.05);
  EXPECT_LT(errors[errors.size() * 9 / 10], 0.12);
}

TEST_F(SceneColors, APickIsThePointUnderThePixel) {
  Scene scene;
  scene.set_mesh(sphere(5, 200));
  int hits = 0;
  for (int y = 0; y < kHeight; y += 20)
    for (int x = 0; x < kWidth; x += 20) {
      const auto inside = on_ball(4.9F, x, y), outside = on_ball(5.1F, x, y);
      const auto picked =
          scene.pick(camera.pick_ray({static_cast<float>(x) + 0.5F, static_cast<float>(y) + 0.5F}, kWhole));
      EXPECT_TRUE(outside || !picked) << x << " " << y;
      if (!inside) continue;
      ASSERT_TRUE(picked) << x << " " << y;
      EXPECT_LT((*picked - *on_ball(5, x, y)).norm(), 0.1F);
      ++hits;
    }
  EXPECT_GT(hits, 20);
}

TEST_F(SceneColors, HeightRunsAlongTheMapNotTheView) {
  Scene scene;
  scene.set_mesh(sphere(5, 128));
  style.color = SceneColor::height;
  camera.look_along(Vector3f::UnitX(), -Vector3f::UnitY());
  const auto legend = scene.legend(style);
  EXPECT_NEAR(legend->min, -5, 0.01);
  EXPECT_NEAR(legend->max, 5, 0.01);
  const cv::Mat3b picture = draw(scene);
  for (const int x : {180, 240, 300}) {
    const float expected = (5 - on_ball(5, x, 180)->z()) / 10;
    EXPECT_NEAR(place_on_map(picture(180, x), scene), expected, 0.08) << x;
  }
}

TEST_F(SceneColors, ACertainPlaceIsClayAndADoubtfulOneIsTinted) {
  MapSnapshot map;
  map.shown_component = 0;
  for (const int id : {0, 10}) {
    MapSnapshot::Node node;
    node.keyframe = id;
    node.component = 0;
    node.covariance(3, 3) = id == 0 ? 0 : 1;
    map.nodes.push_back(node);
  }
  MeshBlock ball = block(1, sphere(5, 96));
  ball.mesh.confidence.assign(ball.mesh.vertices_mm.size(), 20.0F);
  for (const Vector3f& p : ball.mesh.vertices_mm) ball.keyframe.push_back(p.x() < 0 ? 0 : 10);
  Scene scene;
  scene.update(changes({ball}));
  scene.set_map(map);
  style.color = SceneColor::certainty;
  const cv::Mat3b picture = draw(scene);
  const cv::Vec3b certain = picture(180, 215), doubtful = picture(180, 265);
  EXPECT_LT(certain[2] - certain[0], 45);
  EXPECT_GT(doubtful[2] - doubtful[0], 60) << "orange";
}

TEST_F(SceneColors, TextureShowsTextureThatPlainLightHardlyDoes) {
  // 0.01 mm of waves 0.8 mm long
  const Mesh waves = height_field(-5, 5, -5, 5, 200, [](double x, double y) {
    const double k = 2 * std::numbers::pi / 0.8;
    return 0.01 * std::sin(k * x) * std::sin(k * y);
  });
  Scene scene;
  scene.set_mesh(flipped(waves));  // seen from below, where the camera is
  const auto contrast = [&] {
    cv::Scalar mean, deviation;
    cv::meanStdDev(draw(scene)(cv::Rect(200, 140, 80, 80)), mean, deviation);
    return deviation[1] / mean[1];
  };
  const double lit = contrast();
  style.shading = SceneShading::curvature;
  EXPECT_GT(contrast(), 2 * lit);
}

}  // namespace
}  // namespace gelslam::test
