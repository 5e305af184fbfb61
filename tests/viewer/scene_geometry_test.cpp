#include "scene/scene_geometry.hpp"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <limits>
#include <set>

#include "scene/touch_mesh.hpp"
#include "test_meshes.hpp"

namespace gelslam::viewer::detail {
namespace {

using Eigen::Vector3f;

constexpr float kNan = std::numeric_limits<float>::quiet_NaN();

std::multiset<std::array<float, 9>> triangles_by_place(const DrawableMesh& mesh) {
  std::multiset<std::array<float, 9>> result;
  for (std::size_t t = 0; t + 2 < mesh.indices.size(); t += 3) {
    std::array<float, 9> corners{};
    for (std::size_t k = 0; k < 3; ++k) {
      for (int axis = 0; axis < 3; ++axis) {
        corners[3 * k + static_cast<std::size_t>(axis)] = mesh.vertices_mm[mesh.indices[t + k]][axis];
      }
    }
    result.insert(corners);
  }
  return result;
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
  for (const TouchMesh::Vertex& v : make_touch_mesh({surface, Pose::Identity(), 1.0}).vertices)
    inside(cvRound(v.position_mm.y() + 0.5F * side - 0.5F), cvRound(v.position_mm.x() + 0.5F * side - 0.5F)) =
        v.inside;
  for (const int corner : {first, last}) {
    EXPECT_LT(inside(corner, corner), 0);
    EXPECT_GT(inside(corner, side / 2), 0) << "sides stay where they are";
  }
  EXPECT_LT(inside(first - 2, side / 2), 0);
  EXPECT_NEAR(inside(side / 2, side / 2), 1, 1e-3);
}

TEST(SceneGeometry, MakesNormalsOutOfTheTriangles) {
  const DrawableMesh ball = make_drawable(test::sphere(5, 96));
  for (std::size_t i = 0; i < ball.normals.size(); ++i) {
    // a facet of 96 around leans at most half a step: 1.9 degrees
    EXPECT_GT(ball.normals[i].dot(ball.vertices_mm[i].normalized()), std::cos(0.04F));
  }
}

TEST(SceneGeometry, KeepsGivenNormalsAndMakesUnitLengthOfThem) {
  Mesh mesh = test::plane(0, 2);
  mesh.normals.assign(mesh.vertices_mm.size(), Vector3f(0, 3, 4));
  mesh.normals[4] = Vector3f(kNan, 0, 0);
  mesh.normals[5] = Vector3f::Zero();
  const DrawableMesh drawable = make_drawable(mesh);
  for (std::size_t i = 0; i < drawable.normals.size(); ++i) {
    const bool bad = drawable.source[i] == 4 || drawable.source[i] == 5;
    const Vector3f expected = bad ? Vector3f(0, 0, 1) : Vector3f(0, 0.6F, 0.8F);
    EXPECT_LT((drawable.normals[i] - expected).norm(), 1e-5F) << drawable.source[i];
  }
}

TEST(SceneGeometry, CurvatureOfABallIsOneOverItsRadius) {
  for (const double radius : {2.0, 10.0}) {
    Mesh ball = test::sphere(radius, 64);
    for (const Vector3f& p : ball.vertices_mm) ball.normals.push_back(p.normalized());
    for (const float c : make_drawable(ball).curvature) EXPECT_NEAR(c * radius, 1.0, 0.02);
    for (Vector3f& n : ball.normals) n = -n;  // a hollow
    for (const float c : make_drawable(ball).curvature) EXPECT_NEAR(c * radius, -1.0, 0.02);
  }
}

TEST(SceneGeometry, LeavesOutWhatCannotBeDrawn) {
  Mesh mesh = test::plane(0, 4);
  const std::size_t good = make_drawable(mesh).indices.size();
  mesh.vertices_mm.push_back({kNan, 0, 0});
  mesh.vertices_mm.push_back({0, std::numeric_limits<float>::infinity(), 0});
  mesh.vertices_mm.push_back({1e30F, 0, 0});
  const int first = static_cast<int>(mesh.vertices_mm.size()) - 3;
  for (const int bad :
       {first, first + 1, first + 2, first + 3, -1, std::numeric_limits<int>::min(), 1 << 30}) {
    mesh.triangles.emplace_back(0, 1, bad);
  }
  mesh.confidence.assign(mesh.vertices_mm.size(), kNan);
  const DrawableMesh drawable = make_drawable(mesh);
  EXPECT_EQ(drawable.indices.size(), good);
  EXPECT_EQ(drawable.vertices_mm.size(), 25U);
  EXPECT_TRUE(drawable.box_mm.max().allFinite());
  for (const float c : drawable.confidence) EXPECT_EQ(c, 0);
  for (const float c : drawable.curvature) EXPECT_TRUE(std::isfinite(c));
}

TEST(SceneGeometry, NothingOfNothing) {
  EXPECT_TRUE(make_drawable(Mesh()).indices.empty());
  EXPECT_TRUE(split(make_drawable(Mesh()), 100).empty());
  Mesh point;  // a triangle without area
  point.vertices_mm.assign(3, Vector3f(1, 1, 1));
  point.triangles.emplace_back(0, 1, 2);
  const auto pieces = split(make_drawable(point), 100);
  ASSERT_EQ(pieces.size(), 1U);
  EXPECT_TRUE(pieces[0].normals[0].allFinite());
}

TEST(SceneGeometry, PiecesTogetherAreTheMesh) {
  const Mesh mesh = test::sphere(5, 128);
  const DrawableMesh ball = make_drawable(mesh);
  const std::vector<DrawableMesh> pieces = split(ball, 300);
  EXPECT_GT(pieces.size(), 20U);
  std::multiset<std::array<float, 9>> together;
  for (const DrawableMesh& piece : pieces) {
    EXPECT_LT(piece.indices.size() / 3, 2000U);
    together.merge(triangles_by_place(piece));
    for (std::size_t i = 0; i < piece.vertices_mm.size(); ++i) {
      EXPECT_EQ(piece.vertices_mm[i], mesh.vertices_mm[piece.source[i]]);
      EXPECT_TRUE(piece.box_mm.contains(piece.vertices_mm[i]));
    }
  }
  EXPECT_EQ(together, triangles_by_place(ball));
}

TEST(SceneGeometry, PackedNumbersComeBack) {
  Mesh mesh = test::sphere(3, 32);
  mesh.confidence.assign(mesh.vertices_mm.size(), 12.5F);
  const DrawableMesh drawable = make_drawable(mesh);
  const std::vector<float> values(drawable.vertices_mm.size(), 7.25F);
  const std::vector<PackedVertex> packed = pack(drawable, values);
  ASSERT_EQ(packed.size(), drawable.vertices_mm.size());
  for (std::size_t i = 0; i < packed.size(); ++i) {
    EXPECT_EQ(Vector3f(packed[i].position_mm), drawable.vertices_mm[i]);
    for (int axis = 0; axis < 3; ++axis) {
      int bits = static_cast<int>(packed[i].normal >> (10 * axis) & 1023U);
      if (bits > 511) bits -= 1024;
      EXPECT_NEAR(static_cast<float>(bits) / 511, drawable.normals[i][axis], 0.6 / 511);
    }
    EXPECT_EQ(Eigen::half_impl::half_to_float(Eigen::half_impl::raw_uint16_to_half(packed[i].confidence)),
              12.5F);
    EXPECT_EQ(packed[i].value, 7.25F);
  }
  EXPECT_EQ(pack(drawable, {})[0].value, kNoValue);
}

TEST(SceneGeometry, KeyframesOfABlockGoWithTheirVertices) {
  MeshBlock block;
  block.mesh = test::plane(0, 3);
  for (std::size_t i = 0; i < block.mesh.vertices_mm.size(); ++i)
    block.keyframe.push_back(static_cast<int>(100 + i));
  block.mesh.vertices_mm[0].x() = kNan;
  const DrawableMesh drawable = make_drawable(block);
  ASSERT_EQ(drawable.keyframe.size(), drawable.source.size());
  for (std::size_t i = 0; i < drawable.source.size(); ++i) {
    EXPECT_EQ(drawable.keyframe[i], 100 + static_cast<int>(drawable.source[i]));
  }
  block.keyframe.pop_back();  // not as long as the vertices: not to be trusted
  EXPECT_TRUE(make_drawable(block).keyframe.empty());
}

}  // namespace
}  // namespace gelslam::viewer::detail
