#include "scene/scene_geometry.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "scene/touch_mesh.hpp"
#include "test_meshes.hpp"

namespace gelslam::viewer::detail {
namespace {

using Eigen::Vector3f;

constexpr float kNan = std::numeric_limits<float>::quiet_NaN();

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
  Mesh point;  // a triangle without area
  point.vertices_mm.assign(3, Vector3f(1, 1, 1));
  point.triangles.emplace_back(0, 1, 2);
  EXPECT_TRUE(make_drawable(point).normals.at(0).allFinite());
}

TEST(SceneGeometry, PackedNumbersComeBack) {
  Mesh mesh = test::sphere(3, 32);
  mesh.confidence.assign(mesh.vertices_mm.size(), 12.5F);
  const DrawableMesh drawable = make_drawable(mesh, std::vector<float>(mesh.vertices_mm.size(), 7.25F));
  const std::vector<PackedVertex> packed = pack(drawable);
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
  EXPECT_EQ(pack(make_drawable(mesh))[0].value, kNoValue);
}

TEST(SceneGeometry, ValuesGoWithTheirVertices) {
  Mesh mesh = test::plane(0, 3);
  std::vector<float> values;
  for (std::size_t i = 0; i < mesh.vertices_mm.size(); ++i) values.push_back(100 + static_cast<float>(i));
  mesh.vertices_mm[0].x() = values[5] = kNan;
  const DrawableMesh drawable = make_drawable(mesh, values);
  ASSERT_EQ(drawable.value.size(), drawable.source.size());
  for (std::size_t i = 0; i < drawable.source.size(); ++i) {
    const std::uint32_t from = drawable.source[i];
    EXPECT_EQ(drawable.value[i], from == 5 ? kNoValue : 100 + static_cast<float>(from));
  }
  values.pop_back();  // not as long as the vertices: not to be trusted
  EXPECT_EQ(make_drawable(mesh, values).value[0], kNoValue);
}

}  // namespace
}  // namespace gelslam::viewer::detail
