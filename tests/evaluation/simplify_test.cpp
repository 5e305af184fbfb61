#include "gelslam/evaluation/simplify.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <random>

#include "gelslam/mesh/mesh.hpp"
#include "test_meshes.hpp"

namespace gelslam {
namespace {

using testing::Ge;
using testing::Le;
using testing::Lt;

constexpr double kRadiusMm = 5.0;

/// Distance of points on the triangles of `mesh` from the sphere.
double furthest_from_sphere_mm(const Mesh& mesh) {
  double furthest_mm = 0;
  std::mt19937 random(1);
  std::uniform_real_distribution<double> share(0.0, 1.0);
  for (const Eigen::Vector3i& t : mesh.triangles) {
    const auto corner = [&](int k) -> Eigen::Vector3d {
      return mesh.vertices_mm[static_cast<std::size_t>(t[k])].cast<double>();
    };
    for (int i = 0; i < 400; ++i) {
      double u = share(random), v = share(random);
      if (u + v > 1) u = 1 - u, v = 1 - v;
      const Eigen::Vector3d p = corner(0) + u * (corner(1) - corner(0)) + v * (corner(2) - corner(0));
      furthest_mm = std::max(furthest_mm, std::abs(p.norm() - kRadiusMm));
    }
  }
  return furthest_mm;
}

TEST(Simplify, TheErrorIsKeptAndTrianglesFollowIt) {
  const Mesh full = test::sphere(kRadiusMm, 96);
  const double own_mm = furthest_from_sphere_mm(full);  // of the facets
  std::size_t before = 2 * full.triangles.size();       // the first one has to be smaller than the whole
  for (const double max_error_mm : {0.02, 0.08, 0.32}) {
    const SimplifiedMesh result = simplify(full, max_error_mm);
    EXPECT_THAT(result.error_mm, Le(max_error_mm));
    EXPECT_THAT(furthest_from_sphere_mm(result.mesh), Le(2 * max_error_mm + own_mm));
    // Four times the error takes a quarter of the triangles of a sphere; the error allowed is used.
    EXPECT_THAT(result.mesh.triangles.size(), Lt(before / 2));
    EXPECT_THAT(result.error_mm, Ge(0.4 * max_error_mm));
    before = result.mesh.triangles.size();
  }
}

TEST(Simplify, AFlatPlateNeedsAlmostNothingAndRoughnessEverything) {
  EXPECT_THAT(simplify(test::plane(0.0, 30), 0.001).mesh.triangles.size(), Le(200u));
  std::mt19937 random(2);
  std::normal_distribution<double> noise(0.0, 0.05);
  const Mesh rough = test::height_field(-5, 5, -5, 5, 30, [&](double, double) { return noise(random); });
  EXPECT_THAT(simplify(rough, 1e-4).mesh.triangles.size(), Ge(rough.triangles.size() / 2));
}

TEST(Simplify, VerticesKeepPlaceNormalAndConfidence) {
  Mesh full = test::height_field(-5, 5, -5, 5, 60, test::bumps);
  for (const Eigen::Vector3f& v : full.vertices_mm) {
    full.confidence.push_back(v.x() + 6);
    full.normals.push_back(v.normalized());
  }
  const Mesh mesh = simplify(full, 0.05).mesh;
  EXPECT_THAT(mesh.triangles.size(), Lt(full.triangles.size() / 2));
  ASSERT_EQ(mesh.confidence.size(), mesh.vertices_mm.size());
  ASSERT_EQ(mesh.normals.size(), mesh.vertices_mm.size());
  for (std::size_t i = 0; i < mesh.confidence.size(); ++i) {
    EXPECT_EQ(mesh.confidence[i], mesh.vertices_mm[i].x() + 6);
    EXPECT_EQ(mesh.normals[i], mesh.vertices_mm[i].normalized());
  }
}

TEST(MeshShells, TheLargestByAreaAlone) {
  const Mesh small = test::plane(0.0, 8, 2.0), large = test::plane(5.0, 3, 10.0);  // fewer, but more area
  Mesh both = test::joined(small, large);
  for (std::size_t i = 0; i < both.vertices_mm.size(); ++i) both.confidence.push_back(static_cast<float>(i));
  const MeshShells pieces = find_shells(both);
  EXPECT_THAT(pieces.area_mm2,
              testing::ElementsAre(testing::DoubleNear(4, 1e-4), testing::DoubleNear(100, 1e-4)));
  EXPECT_NEAR(pieces.largest_share, 100.0 / 104.0, 1e-6);
  const Mesh alone = largest_shell(both);
  EXPECT_EQ(alone.vertices_mm, large.vertices_mm);
  EXPECT_EQ(alone.triangles, large.triangles);
  EXPECT_EQ(alone.confidence.front(), static_cast<float>(small.vertices_mm.size()));
}

}  // namespace
}  // namespace gelslam
