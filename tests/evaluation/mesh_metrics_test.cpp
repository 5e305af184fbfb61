#include "gelslam/evaluation/mesh_metrics.hpp"

#include <gtest/gtest.h>

#include <numbers>

#include "test_meshes.hpp"

namespace gelslam::test {
namespace {

std::vector<Eigen::Vector3d> points_on(const Mesh& mesh, int count = 20'000) {
  std::vector<Eigen::Vector3d> points;
  for (const SurfaceSample& sample : sample_surface(mesh, count, 9)) points.push_back(sample.point_mm);
  return points;
}

MeshMetrics metrics_of(const Mesh& estimate, const Mesh& truth) {
  return evaluate_mesh(TriangleScene(estimate), TriangleScene(truth), points_on(truth));
}

Pose motion(const Eigen::Vector3d& rotation_deg, const Eigen::Vector3d& translation_mm) {
  Vector6d xi;
  xi << rotation_deg * std::numbers::pi / 180.0, translation_mm;
  return se3_exp(xi);
}

TEST(SampleSurface, FollowsAreaAndTheSeed) {
  // Left: two triangles; right: 20 000 triangles on an equal area.
  const auto flat = [](double, double) { return 0.0; };
  const Mesh mesh = joined(height_field(-5, 0, 0, 5, 1, flat), height_field(0, 5, 0, 5, 100, flat));
  const auto samples = sample_surface(mesh, 10'000, 1);
  ASSERT_EQ(samples.size(), 10'000U);
  int left = 0;
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  for (const SurfaceSample& sample : samples) {
    left += sample.point_mm.x() < 0.0 ? 1 : 0;
    sum += sample.point_mm / 10'000.0;
    ASSERT_TRUE(sample.point_mm.x() < 0.0 ? sample.triangle < 2 : sample.triangle >= 2);
  }
  EXPECT_NEAR(left, 5000, 1);  // systematic sampling: exact but for rounding
  EXPECT_NEAR(sum.x(), 0.0, 0.03);
  EXPECT_NEAR(sum.y(), 2.5, 0.03);
  const auto again = sample_surface(mesh, 10'000, 1), other = sample_surface(mesh, 10'000, 2);
  EXPECT_EQ(samples[77].point_mm, again[77].point_mm);
  EXPECT_NE(samples[77].point_mm, other[77].point_mm);
}

TEST(EvaluateMesh, AShiftedPlaneIsOffByItsShift) {
  const MeshMetrics metrics = metrics_of(plane(0.07), plane(0.0));
  for (const double value :
       {metrics.accuracy.mean_mm, metrics.accuracy.median_mm, metrics.accuracy.p90_mm,
        metrics.accuracy.p95_mm, metrics.completeness.mean_mm, metrics.completeness.p90_mm}) {
    EXPECT_NEAR(value, 0.07, 1e-6);
  }
  ASSERT_EQ(metrics.within.size(), 3U);
  EXPECT_EQ(metrics.within[0].precision, 0.0);
  EXPECT_EQ(metrics.within[0].f_score, 0.0);
  EXPECT_EQ(metrics.within[1].precision, 1.0);
  EXPECT_EQ(metrics.within[1].f_score, 1.0);
}

TEST(EvaluateMesh, HalfASurfaceIsHalfComplete) {
  const auto flat = [](double, double) { return 0.0; };
  const MeshMetrics metrics = metrics_of(height_field(-5, 0, -5, 5, 20, flat), plane(0.0));
  EXPECT_NEAR(metrics.accuracy.mean_mm, 0.0, 1e-7);
  EXPECT_EQ(metrics.within[0].precision, 1.0);
  EXPECT_NEAR(metrics.within[0].completeness, 0.505, 0.004);  // half, and the 0.05 mm beyond its edge
  EXPECT_NEAR(metrics.within[0].f_score, 2 * 0.505 / 1.505, 0.004);
  EXPECT_NEAR(metrics.completeness.mean_mm, 0.5 * 2.5, 0.02);  // the other half is 2.5 mm away on average
}

TEST(AreaAround, IsThatOfTheTouchedPart) {
  const Mesh mesh = height_field(-5, 5, -5, 5, 150, [](double x, double) { return 0.5 * x; });
  std::vector<Eigen::Vector3d> touched_mm;
  for (const Eigen::Vector3f& vertex : mesh.vertices_mm)
    if (std::hypot(vertex.x(), vertex.y()) < 3) touched_mm.push_back(vertex.cast<double>());
  const double disk_mm2 = std::numbers::pi * 9 * std::sqrt(1.25);
  EXPECT_NEAR(area_around(touched_mm, TriangleScene(mesh)), disk_mm2, 0.01 * disk_mm2);
  EXPECT_EQ(area_around({}, TriangleScene(mesh)), 0);
}

TEST(EvaluateMesh, FineTrianglesDoNotCountMore) {
  const Mesh coarse_near = height_field(-5, 0, -5, 5, 1, [](double, double) { return 0.1; });
  const Mesh fine_far = height_field(0, 5, -5, 5, 120, [](double, double) { return 0.3; });
  EXPECT_NEAR(metrics_of(joined(coarse_near, fine_far), plane(0.0)).accuracy.mean_mm, 0.2, 1e-5);
}

TEST(RefineRigidly, RecoversASmallMotion) {
  const Mesh truth = height_field(-6, 6, -6, 6, 120, &bumps);
  const Mesh inner = height_field(-4, 4, -4, 4, 80, &bumps);
  const Pose displaced = motion({1.0, -0.7, 1.2}, {0.15, -0.1, 0.2});
  const Refinement refinement =
      refine_rigidly(TriangleScene(transformed(inner, displaced)), TriangleScene(truth));
  // The two triangulations differ by their chords, about h^2/8 |f''| = 0.003 mm.
  const Pose left_over = refinement.truth_T_estimate * displaced;
  EXPECT_LT(left_over.translation().norm(), 0.003);
  EXPECT_LT(rotation_angle_rad(left_over) * 180.0 / std::numbers::pi, 0.05);
  EXPECT_NEAR(refinement.rotation_deg, rotation_angle_rad(displaced) * 180.0 / std::numbers::pi, 0.05);
  EXPECT_NEAR(refinement.shift_mm, displaced.translation().norm(), 0.03);
}

TEST(RefineRigidly, DoesNotSlideAlongAPlane) {
  const Mesh small_plane = plane(0.0, 10, 4.0);
  const Refinement refinement =
      refine_rigidly(TriangleScene(transformed(small_plane, motion({0, 0, 5}, {0.3, 0.2, 0.05}))),
                     TriangleScene(plane(0.0, 10, 20.0)));
  const Eigen::Vector3d shift = refinement.truth_T_estimate.translation();
  EXPECT_NEAR((shift - Eigen::Vector3d(0, 0, -0.05)).norm(), 0.0, 1e-5);
  EXPECT_NEAR(refinement.rotation_deg, 0.0, 1e-4);
}

TEST(RefineRigidly, LeavesAPerfectMeshAndNeverMakesWorse) {
  const TriangleScene truth(height_field(-5, 5, -5, 5, 60, &bumps));
  EXPECT_LT(refine_rigidly(truth, truth).shift_mm, 1e-6);
  const Mesh far = transformed(plane(0.0), motion({170, 20, 0}, {30, 10, 5}));  // hopeless
  const Refinement refinement = refine_rigidly(TriangleScene(far), truth);
  const double before = evaluate_mesh(TriangleScene(far), truth, {}).accuracy.mean_mm;
  const Mesh refined = transformed(far, refinement.truth_T_estimate);
  EXPECT_LE(evaluate_mesh(TriangleScene(refined), truth, {}).accuracy.mean_mm, before + 0.01);
}

}  // namespace
}  // namespace gelslam::test
