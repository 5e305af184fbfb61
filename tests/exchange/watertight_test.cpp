#include "gelslam/exchange/watertight.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>
#include <numbers>

#include "gelslam/core/error.hpp"
#include "gelslam/mesh/mesh_io.hpp"
#include "test_meshes.hpp"

namespace gelslam {
namespace {

using test::open_or_tangled_edges;
using testing::Each;
using testing::Ge;
using testing::Gt;
using testing::HasSubstr;
using testing::Le;
using testing::Lt;

constexpr double kRadiusMm = 5.0;
constexpr int kSlices = 192;
constexpr double kEdgeMm = 2 * std::numbers::pi * kRadiusMm / kSlices;

WatertightMesh watertight(const Mesh& mesh, bool close) {
  NoProgress silent;
  return make_watertight(mesh, close, silent);
}

/// The part of a mesh whose triangles have all corners where `where` says so.
template <typename Where>
Mesh part_of(const Mesh& mesh, Where&& where) {
  std::vector<Eigen::Vector3i> triangles;
  for (const Eigen::Vector3i& t : mesh.triangles) {
    bool inside = true;
    for (const int corner : t) inside = inside && where(mesh.vertices_mm[static_cast<std::size_t>(corner)]);
    if (inside) triangles.push_back(t);
  }
  return submesh(mesh, triangles);
}

double furthest_from_sphere_mm(const Mesh& mesh) {
  double furthest = 0;
  for (const Eigen::Vector3f& v : mesh.vertices_mm)
    furthest = std::max(furthest, std::abs(v.cast<double>().norm() - kRadiusMm));
  return furthest;
}

constexpr double kSphereMm3 = 4.0 / 3.0 * std::numbers::pi * kRadiusMm * kRadiusMm * kRadiusMm;

TEST(Watertight, ASmallGapIsFilledWithoutClosing) {
  const Mesh sphere = part_of(test::sphere(kRadiusMm, kSlices), [&](const Eigen::Vector3f& v) {
    return std::hypot(v.y(), v.z()) > kEdgeMm || v.x() < 0;
  });
  ASSERT_THAT(open_or_tangled_edges(sphere), Gt(0));
  const WatertightMesh result = watertight(sphere, false);
  EXPECT_EQ(open_or_tangled_edges(result.mesh), 0);
  EXPECT_THAT(furthest_from_sphere_mm(result.mesh), Le(0.3 * kEdgeMm));
  EXPECT_NEAR(result.volume_mm3, kSphereMm3, 0.005 * kSphereMm3);
}

TEST(Watertight, ALargeGapStaysOpenUntilClosed) {
  const Mesh touched = part_of(test::sphere(kRadiusMm, kSlices),
                               [](const Eigen::Vector3f& v) { return v.x() < 0.5F * kRadiusMm; });
  const WatertightMesh open = watertight(touched, false);
  EXPECT_THAT(open_or_tangled_edges(open.mesh), Gt(0));
  EXPECT_EQ(open.volume_mm3, 0);
  for (const Eigen::Vector3f& v : open.mesh.vertices_mm)
    EXPECT_THAT(v.x(), Le(0.5 * kRadiusMm + open.reach_mm));
  const WatertightMesh closed = watertight(touched, true);
  EXPECT_EQ(open_or_tangled_edges(closed.mesh), 0);
  // Between the sphere cut off flat, and the whole one.
  const double cap_mm3 = 5.0 / 24.0 * std::numbers::pi * kRadiusMm * kRadiusMm * kRadiusMm;
  EXPECT_THAT(closed.volume_mm3, Ge(0.98 * (kSphereMm3 - cap_mm3)));
  EXPECT_THAT(closed.volume_mm3, Le(1.02 * kSphereMm3));
  const Mesh there = part_of(closed.mesh, [](const Eigen::Vector3f& v) { return v.x() < 0.4F * kRadiusMm; });
  EXPECT_THAT(furthest_from_sphere_mm(there), Le(0.1 * kEdgeMm));
  EXPECT_THAT(closed.touched_share, Lt(0.95));
}

constexpr double kSizeMm = 10;
constexpr int kCells = 80;

Mesh bumps_of_one_side() {
  Mesh touched = test::height_field(-5, 5, -5, 5, kCells, test::bumps);
  touched.confidence.assign(touched.vertices_mm.size(), 7.0F);
  return touched;
}

const WatertightMesh& plate() {
  static const WatertightMesh plate = watertight(bumps_of_one_side(), true);
  return plate;
}

TEST(Watertight, ASurfaceTouchedFromOneSideGetsABack) {
  EXPECT_EQ(open_or_tangled_edges(plate().mesh), 0);
  // A plate of a tenth of its size, and the convex hull of the bumps at most.
  EXPECT_THAT(plate().volume_mm3, Ge(0.1 * kSizeMm * kSizeMm * kSizeMm));
  EXPECT_THAT(plate().volume_mm3, Le(0.4 * kSizeMm * kSizeMm * kSizeMm));
  // Its face is the touched surface: the heights of what lies well inside and faces up.
  double furthest_mm = 0;
  int seen = 0;
  for (std::size_t i = 0; i < plate().mesh.vertices_mm.size(); ++i) {
    const Eigen::Vector3d v = plate().mesh.vertices_mm[i].cast<double>();
    if (std::max(std::abs(v.x()), std::abs(v.y())) > 4.5 || plate().mesh.normals[i].z() < 0.5F) continue;
    furthest_mm = std::max(furthest_mm, std::abs(v.z() - test::bumps(v.x(), v.y())));
    ++seen;
  }
  EXPECT_THAT(seen, Gt(kCells * kCells / 2));
  EXPECT_THAT(furthest_mm, Le(0.1 * kSizeMm / kCells));
}

TEST(Watertight, ConfidenceEndsWhereNothingWasTouched) {
  EXPECT_THAT(watertight(bumps_of_one_side(), false).mesh.confidence, Each(7.0F));
  ASSERT_EQ(plate().mesh.confidence.size(), plate().mesh.vertices_mm.size());
  for (std::size_t i = 0; i < plate().mesh.vertices_mm.size(); ++i) {
    const Eigen::Vector3d v = plate().mesh.vertices_mm[i].cast<double>();
    const double above_mm = v.z() - test::bumps(v.x(), v.y());
    if (std::abs(above_mm) < 0.1 && v.head<2>().cwiseAbs().maxCoeff() < 4.5) {
      EXPECT_EQ(plate().mesh.confidence[i], 7.0F);
    } else if (above_mm < -0.9) {
      EXPECT_EQ(plate().mesh.confidence[i], 0.0F);
    }
  }
}

TEST(Watertight, CoarseTrianglesAreSampled) {
  const Mesh top = test::plane(1.0, 1, 2.0);  // two triangles
  Mesh cube = top;
  const auto add_side = [&](double turns, const Eigen::Vector3f& axis) {
    const Eigen::AngleAxisf turn(static_cast<float>(turns * 2 * std::numbers::pi), axis);
    Mesh side = top;
    for (Eigen::Vector3f& v : side.vertices_mm) v = turn * v;
    cube = test::joined(cube, side);
  };
  for (const double turns : {0.25, 0.5, 0.75}) add_side(turns, Eigen::Vector3f::UnitX());
  for (const double turns : {0.25, 0.75}) add_side(turns, Eigen::Vector3f::UnitY());
  const WatertightMesh body = watertight(cube, true);
  EXPECT_EQ(open_or_tangled_edges(body.mesh), 0);
  EXPECT_NEAR(body.volume_mm3, 8.0, 0.08);
}

TEST(Watertight, WhatHasNoInsideIsRefused) {
  const auto refusal = [](const Mesh& mesh) -> std::string {
    try {
      watertight(mesh, true);
      return "";
    } catch (const Error& error) {
      return error.what();
    }
  };
  EXPECT_THAT(refusal(test::flipped(test::sphere(1, 32))), HasSubstr("face outward"));
  EXPECT_THAT(refusal(Mesh()), HasSubstr("no triangles"));
  Mesh flat = test::plane(0, 4);
  for (Eigen::Vector3f& v : flat.vertices_mm) v.setConstant(1);
  EXPECT_THAT(refusal(flat), HasSubstr("no area"));
  Mesh needle;
  needle.vertices_mm = {{0, 0, 0}, {1, 0, 0}, {0, 1e-6F, 0}};
  needle.triangles = {{0, 1, 2}};
  EXPECT_THAT(refusal(needle), HasSubstr("too small for its extent"));
}

}  // namespace
}  // namespace gelslam
