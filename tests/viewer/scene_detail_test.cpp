#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <map>

#include "scene/scene_geometry.hpp"
#include "test_meshes.hpp"

namespace gelslam::viewer::detail {
namespace {

using Eigen::Vector3f;
using Place = std::array<float, 3>;

Place place_of(const Vector3f& p) { return {p.x(), p.y(), p.z()}; }

/// Adds +1 for each directed edge and -1 for its opposite, by the places of its ends: a closed surface ends
/// at zero.
void add_edges(const DrawableMesh& mesh, const std::vector<std::uint32_t>& indices,
               std::map<std::pair<Place, Place>, int>& balance) {
  for (std::size_t i = 0; i < indices.size(); ++i) {
    const Place a = place_of(mesh.vertices_mm[indices[i]]);
    const Place b = place_of(mesh.vertices_mm[indices[i % 3 == 2 ? i - 2 : i + 1]]);
    if (a < b) {
      ++balance[{a, b}];
    } else {
      --balance[{b, a}];
    }
  }
}

int open_edges(const std::vector<DrawableMesh>& pieces, float cell_mm) {
  std::map<std::pair<Place, Place>, int> balance;
  for (const DrawableMesh& piece : pieces) add_edges(piece, cluster_vertices(piece, cell_mm), balance);
  int open = 0;
  for (const auto& [edge, count] : balance) open += count != 0;
  return open;
}

/// A ball without the seams of test::sphere(): a cube blown up.
Mesh seamless_ball(double radius, int cells) {
  Mesh ball;
  std::map<Place, int> index;
  const auto vertex = [&](const Vector3f& cube) {
    const auto [found, is_new] = index.try_emplace(place_of(cube), static_cast<int>(ball.vertices_mm.size()));
    if (is_new) ball.vertices_mm.push_back(static_cast<float>(radius) * cube.normalized());
    return found->second;
  };
  for (int axis = 0; axis < 3; ++axis) {
    for (const float side : {-1.0F, 1.0F}) {
      const auto corner = [&](int i, int j) {
        Vector3f p;
        p[axis] = side;
        p[(axis + 1) % 3] = 2 * static_cast<float>(i) / static_cast<float>(cells) - 1;
        p[(axis + 2) % 3] = 2 * static_cast<float>(j) / static_cast<float>(cells) - 1;
        return vertex(p);
      };
      for (int i = 0; i < cells; ++i) {
        for (int j = 0; j < cells; ++j) {
          int a = corner(i, j), b = corner(i + 1, j), c = corner(i, j + 1), d = corner(i + 1, j + 1);
          if (side < 0) std::swap(b, c);
          ball.triangles.emplace_back(a, b, d);
          ball.triangles.emplace_back(a, d, c);
        }
      }
    }
  }
  return ball;
}

/// The half of a mesh whose triangles begin left or right of a plane.
DrawableMesh half_of(const Mesh& mesh, bool left) {
  Mesh half = mesh;
  std::erase_if(half.triangles, [&](const Eigen::Vector3i& t) {
    return (mesh.vertices_mm[static_cast<std::size_t>(t[0])].x() < 0.4F) != left;
  });
  return make_drawable(half);
}

TEST(SceneDetail, CountsFallWithTheCell) {
  const DrawableMesh ball = make_drawable(seamless_ball(5, 80));  // edges of about 0.1 mm
  const std::size_t full = ball.indices.size();
  const std::size_t half = cluster_vertices(ball, 0.25F).size(),
                    quarter = cluster_vertices(ball, 0.5F).size();
  EXPECT_LT(half, full / 2);
  EXPECT_LT(quarter, half / 2);
  EXPECT_GT(quarter, full / 100);
  EXPECT_EQ(cluster_vertices(ball, 1e-4F).size(), full) << "cells smaller than every edge change nothing";
  Mesh speck = seamless_ball(5, 10);
  for (Vector3f& p : speck.vertices_mm) p += Vector3f(50, 50, 50);  // not on a corner of eight cells
  EXPECT_TRUE(cluster_vertices(make_drawable(speck), 1000).empty());
}

TEST(SceneDetail, NeighborsStillMeet) {
  const Mesh ball = seamless_ball(5, 60);
  for (const float cell : {0.25F, 0.5F, 1.0F}) {
    EXPECT_EQ(open_edges({make_drawable(ball)}, cell), 0) << "one piece, cell " << cell;
    EXPECT_EQ(open_edges({half_of(ball, true), half_of(ball, false)}, cell), 0)
        << "two halves, cell " << cell;
    EXPECT_EQ(open_edges(split(make_drawable(ball), 400), cell), 0)
        << "many, meeting in corners, cell " << cell;
  }
}

TEST(SceneDetail, NeighborsMeetWhateverTheirLevels) {
  std::map<std::pair<Place, Place>, int> balance;
  float cell = 0.1F;
  for (const DrawableMesh& piece : split(make_drawable(seamless_ball(5, 60)), 400)) {
    add_edges(piece, cluster_vertices(piece, cell), balance);
    cell = cell > 2 ? 0.1F : 2 * cell;
  }
  for (const auto& [edge, count] : balance) EXPECT_EQ(count, 0);
}

TEST(SceneDetail, VerticesAreTheMeshsOwnAndStayInTheirCells) {
  const DrawableMesh ball = make_drawable(seamless_ball(5, 60));
  const float cell = 0.5F;
  for (const std::uint32_t index : cluster_vertices(ball, cell)) ASSERT_LT(index, ball.vertices_mm.size());
  // Every vertex of the ball has a chosen one within a cell's diagonal.
  const std::vector<std::uint32_t> coarse = cluster_vertices(ball, cell);
  for (std::size_t i = 0; i < ball.vertices_mm.size(); i += 37) {
    float nearest = 1e9F;
    for (const std::uint32_t k : coarse)
      nearest = std::min(nearest, (ball.vertices_mm[k] - ball.vertices_mm[i]).norm());
    EXPECT_LT(nearest, 2 * std::sqrt(3.0F) * cell);
  }
}

TEST(SceneDetail, FarFromTheOriginToo) {
  Mesh ball = seamless_ball(5, 40);
  for (Vector3f& p : ball.vertices_mm) p += Vector3f(-9000, 20000, 5);
  const std::vector<std::uint32_t> coarse = cluster_vertices(make_drawable(ball), 0.5F);
  EXPECT_GT(coarse.size(), 1000U);
  EXPECT_EQ(open_edges({half_of(ball, true), half_of(ball, false)}, 0.5F), 0);
}

}  // namespace
}  // namespace gelslam::viewer::detail
