#include "gelslam/viewer/orbit_camera.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <random>
#include <vector>

namespace gelslam {
namespace {

using Eigen::Vector2f;
using Eigen::Vector3f;
using Eigen::Vector4f;

constexpr Viewport kView{0, 0, 900, 600};
constexpr double kDegree = std::numbers::pi / 180;

/// Where a point comes to lie, by the matrices alone: pixels from the top left corner.
Vector2f on_screen(const OrbitCamera& camera, const Vector3f& point, const Viewport& viewport = kView) {
  const Eigen::AlignedBox3f box(point - Vector3f::Ones(), point + Vector3f::Ones());
  const Vector4f clip =
      camera.projection(viewport.aspect(), box) * camera.camera_T_map() * point.homogeneous();
  return {(clip.x() / clip.w() + 1) / 2 * static_cast<float>(viewport.width),
          (1 - clip.y() / clip.w()) / 2 * static_cast<float>(viewport.height)};
}

Vector3f direction_of_view(const OrbitCamera& camera) { return -camera.map_R_camera().col(2); }

OrbitCamera turned_camera() {
  OrbitCamera camera;
  camera.look_along(Vector3f(0.3F, -0.7F, 0.5F), Vector3f(0.1F, 0.2F, 0.9F));
  camera.look_at({4, -3, 12});
  camera.set_distance_mm(35);
  return camera;
}

/// The point of the plane through the center, across the line of sight, that lies under a pixel.
Vector3f in_center_plane(const OrbitCamera& camera, const Vector2f& pixel) {
  const PickRay ray = camera.pick_ray(pixel, kView);
  const Vector3f forward = direction_of_view(camera);
  return ray.origin_mm +
         ray.direction * ((camera.center_mm() - ray.origin_mm).dot(forward) / ray.direction.dot(forward));
}

TEST(OrbitCamera, StartsAsTheSensorLooks) {
  const OrbitCamera camera;
  EXPECT_LT((direction_of_view(camera) - Vector3f::UnitZ()).norm(), 1e-6F);
  const Vector2f middle = on_screen(camera, Vector3f::Zero());
  EXPECT_LT((middle - Vector2f(450, 300)).norm(), 0.01F);
  const Vector2f right = on_screen(camera, Vector3f(5, 0, 0)), down = on_screen(camera, Vector3f(0, 5, 0));
  EXPECT_GT(right.x(), middle.x() + 10) << "the image's x goes right";
  EXPECT_GT(down.y(), middle.y() + 10) << "the image's y goes down";
}

TEST(OrbitCamera, PickRayIsTheInverseOfTheMatrices) {
  const OrbitCamera camera = turned_camera();
  for (const Vector2f& pixel : {Vector2f(450, 300), Vector2f(12, 577), Vector2f(890, 3)}) {
    const PickRay ray = camera.pick_ray(pixel, kView);
    EXPECT_NEAR(ray.direction.norm(), 1, 1e-5);
    for (const float depth : {10.0F, 35.0F, 200.0F}) {
      EXPECT_LT((on_screen(camera, ray.origin_mm + depth * ray.direction) - pixel).norm(), 0.05F);
    }
  }
}

TEST(OrbitCamera, PanKeepsThePointUnderTheCursor) {
  OrbitCamera camera = turned_camera();
  const Vector2f from(200, 450), movement(137, -61);
  const Vector3f point = in_center_plane(camera, from);
  camera.pan(movement, kView);
  EXPECT_LT((on_screen(camera, point) - (from + movement)).norm(), 0.05F);
}

TEST(OrbitCamera, ZoomKeepsThePointUnderTheCursorAndTheSizeFollows) {
  const Vector2f cursor(733, 110);
  for (const double steps : {3.0, -4.0, 0.5}) {
    OrbitCamera camera = turned_camera();
    const Vector3f point = in_center_plane(camera, cursor);
    camera.zoom(steps, cursor, kView);
    EXPECT_LT((on_screen(camera, point) - cursor).norm(), 0.05F) << steps;
    EXPECT_EQ(camera.distance_mm() < 35, steps > 0);
  }
}

TEST(OrbitCamera, OrbitDragsTheFrontWithTheCursorAndKeepsTheCenter) {
  OrbitCamera camera = turned_camera();
  const Vector3f front = camera.center_mm() - 5.0F * direction_of_view(camera);
  const Vector3f center = camera.center_mm();
  const Vector2f before = on_screen(camera, front);
  camera.orbit({40, 25}, kView);
  const Vector2f moved = on_screen(camera, front) - before;
  EXPECT_GT(moved.x(), 5);
  EXPECT_GT(moved.y(), 3);
  EXPECT_LT((camera.center_mm() - center).norm(), 1e-6F);
  EXPECT_NEAR((camera.eye_mm() - center).norm(), 35, 1e-3);
}

TEST(OrbitCamera, FittedShowsAllAndFillsTheView) {
  std::mt19937 random(7);
  std::uniform_real_distribution<float> place(-1, 1);
  for (int trial = 0; trial < 60; ++trial) {
    const Viewport viewport{0, 0, trial % 2 == 0 ? 1400 : 300, 600};
    std::vector<Vector3f> points;
    const Vector3f size(1 + 20 * std::abs(place(random)), 8, 1 + 3 * std::abs(place(random)));
    for (int i = 0; i < 50; ++i) {
      points.push_back(size.cwiseProduct(Vector3f(place(random), place(random), place(random))) +
                       Vector3f(100, -40, 7));
    }
    OrbitCamera camera;
    camera.look_along(Vector3f(place(random), place(random), place(random)), Vector3f(0, 1, 0.1F));
    camera = camera.fitted(points, viewport);
    Eigen::AlignedBox2f seen;
    for (const Vector3f& point : points) seen.extend(on_screen(camera, point, viewport));
    const Eigen::AlignedBox2f all(
        Vector2f(0, 0), Vector2f(static_cast<float>(viewport.width), static_cast<float>(viewport.height)));
    EXPECT_TRUE(all.contains(seen)) << trial;
    const Vector2f share = seen.sizes().cwiseQuotient(all.sizes());
    // Perspective makes the near side larger than the far one, which the middle does not allow for.
    EXPECT_GT(share.maxCoeff(), 0.6F) << trial;
  }
}

TEST(OrbitCamera, FollowBringsTheTouchToTheMiddleFacingTheViewer) {
  for (const double angle_deg : {0.0, 20.0, 90.0, 180.0}) {
    Pose touch = Pose::Identity();
    touch.linear() = so3_exp({angle_deg * kDegree, 0, 0.3});
    touch.translation() = Eigen::Vector3d(7, -2, 5);
    OrbitCamera camera;
    for (int i = 0; i < 400; ++i) camera.follow(touch, 0.02);
    EXPECT_LT((on_screen(camera, Vector3f(7, -2, 5)) - Vector2f(450, 300)).norm(), 1);
    const float cosine = direction_of_view(camera).dot(touch.linear().col(2).cast<float>());
    EXPECT_GT(cosine, std::cos(26 * kDegree)) << angle_deg;
  }
}

}  // namespace
}  // namespace gelslam
