#include "gelslam/slam/guidance.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>

namespace gelslam {
namespace {

using Eigen::Vector3f;

constexpr int kRings = 40, kColumns = 80;
constexpr double kRadiusMm = 6;

/// A sphere in blocks of eight columns that share their border's vertices; `keep` says which quads are there.
MeshBlocks sphere(const std::function<bool(int ring, int column)>& keep) {
  MeshBlocks blocks;
  const auto at = [](int ring, int column) {
    const double polar = M_PI * ring / kRings, around = 2 * M_PI * (column % kColumns) / kColumns;
    return Vector3f((kRadiusMm * Eigen::Vector3d(std::sin(polar) * std::cos(around),
                                                 std::sin(polar) * std::sin(around), std::cos(polar)))
                        .cast<float>());
  };
  for (int first = 0; first < kColumns; first += 8) {
    auto mesh = std::make_shared<Mesh>();
    for (int column = first; column <= first + 8; ++column)
      for (int ring = 0; ring <= kRings; ++ring) {
        const bool pole = ring == 0 || ring == kRings;
        mesh->vertices_mm.push_back(at(ring, pole ? 0 : column));
      }
    for (int column = 0; column < 8; ++column)
      for (int ring = 0; ring < kRings; ++ring) {
        if (!keep(ring, first + column)) continue;
        const int a = column * (kRings + 1) + ring, b = a + kRings + 1;
        if (ring + 1 < kRings) mesh->triangles.emplace_back(a, a + 1, b + 1);
        if (ring > 0) mesh->triangles.emplace_back(a, b + 1, b);
      }
    blocks.emplace(first, mesh);
  }
  return blocks;
}

MapSnapshot::Node node(int id, const Vector3f& place, double sigma_mm) {
  MapSnapshot::Node node;
  node.keyframe = id;
  node.component_T_keyframe.translation() = place.cast<double>();
  node.sigma_mm = sigma_mm;
  return node;
}

TEST(MeshBorder, AClosedSurfaceInBlocksHasNone) {
  MeshBorder border;
  border.update(sphere([](int, int) { return true; }));
  EXPECT_NEAR(border.area_mm2(), 4 * M_PI * kRadiusMm * kRadiusMm, 3);
  EXPECT_TRUE(border.loops(0.01).empty());
}

TEST(MeshBorder, FindsHolesWithTheirAreaAndTheWayOut) {
  MeshBorder border;
  // The cap around +z above 45 degrees, and a small hole on the other side.
  border.update(sphere([](int ring, int column) {
    return ring >= kRings / 4 && !(ring >= 30 && ring < 32 && column >= 10 && column < 14);
  }));
  const std::vector<MeshBorder::Loop> loops = border.loops(0.1);
  ASSERT_EQ(loops.size(), 2U);
  const double cap_radius_mm = kRadiusMm * std::sin(M_PI / 4);
  EXPECT_NEAR(loops[0].hole_mm2, M_PI * cap_radius_mm * cap_radius_mm, 0.5);
  EXPECT_LT(loops[1].hole_mm2, 2);
  EXPECT_EQ(loops[0].edges.size(), static_cast<std::size_t>(kColumns));
  EXPECT_EQ(border.loops(5).size(), 1U);
  for (const MeshBorder::Edge& edge : loops[0].edges) EXPECT_GT(edge.outward.z(), 0.5F) << "toward the pole";
}

TEST(MeshBorder, ABandThatIsNotClosedLeavesBothEndsOpen) {
  MeshBorder border;
  border.update(sphere([](int ring, int column) { return ring >= 10 && ring < 30 && column > 0; }));
  const std::vector<MeshBorder::Loop> loops = border.loops(0.1);
  ASSERT_EQ(loops.size(), 1U) << "one border runs around both";
  const double end_mm2 = M_PI * std::pow(kRadiusMm * std::sin(M_PI / 4), 2);
  EXPECT_GT(loops[0].hole_mm2, 2 * end_mm2);
}

TEST(MeshBorder, SeesOnlyBlocksThatHaveChanged) {
  MeshBlocks blocks = sphere([](int, int) { return true; });
  MeshBorder border;
  border.update(blocks);
  const double whole_mm2 = border.area_mm2();
  blocks.erase(8);
  border.update(blocks);
  EXPECT_NEAR(border.area_mm2(), 0.9 * whole_mm2, 0.5);
  EXPECT_EQ(border.loops(1).size(), 1U);
}

TEST(Guidance, PointsToTheNearestHoleAndSaysHowMuchIsClosed) {
  MeshBorder border;
  border.update(sphere([](int ring, int) { return ring >= kRings / 4 && ring < 35; }));
  const Guidance guidance = guide(border, {}, Vector3f(0, 0, -6), {});
  ASSERT_TRUE(guidance.target);
  EXPECT_EQ(guidance.target->reason, Guidance::Reason::hole);
  EXPECT_LT(guidance.target->place_mm.z(), -5) << "the hole at the lower pole is nearer";
  EXPECT_GT(guidance.closed_share, 0.6);
  EXPECT_LT(guidance.closed_share, 0.85);
  EXPECT_FALSE(guidance.is_enough());
  EXPECT_GT(guide(border, {}, Vector3f(0, 0, 6), {}).target->place_mm.z(), 4);
}

TEST(Guidance, KeepsItsTargetWhileTheWayIsNotTwiceAsLong) {
  MeshBorder border;
  border.update(sphere([](int ring, int) { return ring >= 4 && ring < 36; }));  // holes at both poles
  const Guidance up = guide(border, {}, Vector3f(6, 0, 1), {});
  ASSERT_GT(up.target->place_mm.z(), 0);
  EXPECT_GT(guide(border, {}, Vector3f(6, 0, -1), up).target->place_mm.z(), 0) << "kept";
  EXPECT_LT(guide(border, {}, Vector3f(1, 0, -5), up).target->place_mm.z(), 0) << "too far now";
}

TEST(Guidance, LeadsBackToAPlaceThatIsKnownBetterOnceDriftIsLarge) {
  MeshBorder border;
  border.update(sphere([](int ring, int) { return ring >= 4; }));
  MapSnapshot map;
  map.nodes = {node(0, Vector3f(0, 0, -6), 0), node(1, Vector3f(6, 0, 0), 0.02),
               node(2, Vector3f(0, 0, 6), 0.09)};
  map.nodes.push_back(node(3, Vector3f(-6, 0, 0), 0.1));
  map.nodes.push_back(node(4, Vector3f(-4, 0, -4), 0.2));
  for (int id = 1; id <= 4; ++id) map.edges.push_back({id - 1, id, EdgeKind::odometry, false});
  const Guidance round = guide(border, map, Vector3f(-4, 0, -4), {});
  ASSERT_TRUE(round.target);
  EXPECT_EQ(round.target->reason, Guidance::Reason::drift);
  EXPECT_LT((round.target->place_mm - Vector3f(0, 0, -6)).norm(), 1e-3F) << "forward to where the scan began";
  EXPECT_NEAR(*round.drift_mm, 0.4, 1e-9);
  EXPECT_EQ(guide(border, map, Vector3f(0, 1, 6), {}).target->reason, Guidance::Reason::hole)
      << "half way round no loop is nearer than the way back";
  MapSnapshot closed = map;
  closed.edges.push_back({0, 4, EdgeKind::loop, false});
  EXPECT_EQ(guide(border, closed, Vector3f(-4, 0, -4), {}).target->reason, Guidance::Reason::hole)
      << "that loop is there already";
  closed.edges.back().outlier = true;
  EXPECT_EQ(guide(border, closed, Vector3f(-4, 0, -4), {}).target->reason, Guidance::Reason::drift);
  for (MapSnapshot::Node& each : map.nodes) each.sigma_mm *= 0.2;
  EXPECT_EQ(guide(border, map, Vector3f(-4, 0, -4), {}).target->reason, Guidance::Reason::hole);
}

TEST(Guidance, GivesUpWhereTheSurfaceDoesNotGrow) {
  MeshBorder border;
  border.update(sphere([](int ring, int) { return ring >= 4 && ring < 36; }));  // holes at both poles
  const Vector3f touch(3, 0, 5);
  Guidance guidance;
  int looks = 0;
  do guidance = guide(border, {}, touch, guidance);
  while (guidance.target && guidance.target->place_mm.z() > 0 && ++looks < 100);
  EXPECT_GE(looks, 6) << "not at once";
  EXPECT_LT(looks, 40);
  ASSERT_TRUE(guidance.target) << "the other pole is open, too";
  guidance = {};
  for (int ring = 8; ring > 0; --ring) {  // it grows
    border.update(sphere([&](int r, int) { return r >= ring && r < 36; }));
    for (int look = 0; look < 3; ++look) guidance = guide(border, {}, touch, guidance);
  }
  EXPECT_TRUE(guidance.given_up.empty());
}

TEST(Guidance, SaysWhenEnoughIsThere) {
  MeshBorder border;
  border.update(sphere([](int, int) { return true; }));
  MapSnapshot map;
  map.nodes = {node(0, Vector3f(0, 0, -6), 0), node(1, Vector3f(0, 0, 6), 0.025)};
  const Guidance guidance = guide(border, map, Vector3f(0, 0, 6), {});
  EXPECT_TRUE(guidance.is_enough());
  EXPECT_FALSE(guidance.target);
  EXPECT_NEAR(*guidance.drift_mm, 0.05, 1e-9);
  EXPECT_FALSE(guide({}, map, Vector3f(0, 0, 6), {}).is_enough());
}

TEST(Guidance, SurvivesBrokenMeshes) {
  auto broken = std::make_shared<Mesh>();
  broken->vertices_mm = {Vector3f(0, 0, 0), Vector3f(1, 0, 0), Vector3f(0, std::nanf(""), 0),
                         Vector3f(1, 1, 0)};
  broken->triangles = {{0, 1, 2}, {0, 1, 9}, {-1, 0, 1}, {1, 1, 1}};
  MeshBorder border;
  border.update({{1, broken}});
  guide(border, {}, Vector3f::Zero(), {});
}

}  // namespace
}  // namespace gelslam
