#include "gelslam/evaluation/triangle_scene.hpp"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <limits>
#include <random>

#include "test_meshes.hpp"

namespace gelslam {
namespace {

double uniform(std::mt19937_64& random) { return static_cast<double>(random() >> 11) * 0x1.0p-53; }

Eigen::Vector3d random_point(std::mt19937_64& random, double range) {
  const double x = uniform(random), y = uniform(random), z = uniform(random);
  return range * (Eigen::Vector3d(x, y, z) - Eigen::Vector3d::Constant(0.5));
}

Mesh soup(int triangles, std::mt19937_64& random) {
  Mesh mesh;
  for (int t = 0; t < triangles; ++t) {
    const Eigen::Vector3d center = random_point(random, 10.0);
    for (int k = 0; k < 3; ++k)
      mesh.vertices_mm.emplace_back((center + random_point(random, 2.0)).cast<float>());
    mesh.triangles.emplace_back(3 * t, 3 * t + 1, 3 * t + 2);
  }
  return mesh;
}

/// By brute force over a grid of each triangle: an upper bound of the distance, too large by at most the
/// grid's step.
double nearest_on_grid(const Mesh& mesh, const Eigen::Vector3d& p, int steps) {
  double best = std::numeric_limits<double>::infinity();
  for (const Eigen::Vector3i& t : mesh.triangles) {
    const auto corner = [&](int k) -> Eigen::Vector3d {
      return mesh.vertices_mm[static_cast<std::size_t>(t[k])].cast<double>();
    };
    for (int i = 0; i <= steps; ++i) {
      for (int j = 0; i + j <= steps; ++j) {
        const double u = static_cast<double>(i) / steps, v = static_cast<double>(j) / steps;
        best = std::min(best, ((1 - u - v) * corner(0) + u * corner(1) + v * corner(2) - p).norm());
      }
    }
  }
  return best;
}

TEST(TriangleScene, ClosestAgreesWithBruteForce) {
  std::mt19937_64 random(3);
  Mesh mesh = soup(40, random);
  mesh.triangles.emplace_back(0, 0, 0);  // without area: a point and a line
  mesh.triangles.emplace_back(3, 4, 3);
  const TriangleScene scene(mesh);
  constexpr int kSteps = 60;
  for (int i = 0; i < 60; ++i) {
    const Eigen::Vector3d p = random_point(random, 14.0);
    const ClosestPoint closest = scene.closest({p}).front();
    EXPECT_NEAR((closest.point_mm - p).norm(), closest.distance_mm, 1e-12);
    const double on_grid = nearest_on_grid(mesh, p, kSteps);
    EXPECT_LE(closest.distance_mm, on_grid + 1e-6);
    EXPECT_GE(closest.distance_mm, on_grid - 3.5 / kSteps);  // edges are at most 2 sqrt(3) long
    Mesh named;
    named.vertices_mm = mesh.vertices_mm;
    named.triangles = {mesh.triangles[static_cast<std::size_t>(closest.triangle)]};
    EXPECT_NEAR(nearest_on_grid(named, p, kSteps), on_grid, 3.5 / kSteps);
  }
}

TEST(TriangleScene, ClosestIsExactAtFacesEdgesAndCorners) {
  const TriangleScene scene(test::plane(0.0));
  EXPECT_NEAR(scene.closest({{1.23, 2.1, 0.37}}).front().distance_mm, 0.37, 1e-7);
  EXPECT_NEAR(scene.closest({{8.0, 0.2, 4.0}}).front().distance_mm, 5.0, 1e-7);  // over the edge x = 5
  EXPECT_NEAR(scene.closest({{6.0, 7.0, 2.0}}).front().distance_mm, 3.0, 1e-7);  // off the corner
  EXPECT_NEAR(scene.closest({{0.0, 0.0, 1e4}}).front().distance_mm, 1e4, 1e-3);
  const std::vector centers(99, Eigen::Vector3d(0, 0, 0));  // as far from every triangle
  EXPECT_NEAR(TriangleScene(test::sphere(5.0)).closest(centers).back().distance_mm, 5.0, 0.01);
  // A corner shared by six triangles: the lowest index, whatever the order of traversal.
  EXPECT_EQ(scene.closest({{-4.0, -4.0, 1.0}}).front().triangle, 0);
}

}  // namespace
}  // namespace gelslam
