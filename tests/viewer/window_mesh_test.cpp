#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "gelslam/mesh/mesh_io.hpp"
#include "live/mesh_export.hpp"
#include "temporary_folder.hpp"

namespace gelslam::viewer::detail {
namespace {

/// A strip of the plane z = 0 of 1 mm squares, two triangles each, columns `from` to `to`.
MeshBlock strip(std::int64_t key, int from, int to, bool with_normals = true) {
  MeshBlock block;
  block.key = key;
  for (int x = from; x <= to; ++x)
    for (int y = 0; y <= 1; ++y) {
      block.mesh.vertices_mm.emplace_back(0.1F * static_cast<float>(x), static_cast<float>(y), 0.0F);
      if (with_normals) block.mesh.normals.emplace_back(0, 0, 1);
    }
  for (int i = 0; i < to - from; ++i) {
    block.mesh.triangles.emplace_back(2 * i, 2 * i + 2, 2 * i + 1);
    block.mesh.triangles.emplace_back(2 * i + 1, 2 * i + 2, 2 * i + 3);
  }
  return block;
}

MeshBlocks one_strip() { return {{1, std::make_shared<const Mesh>(strip(1, 0, 3).mesh)}}; }

TEST(WindowMesh, JoinsBlocksAtTheirBorder) {
  WindowMesh mesh;
  mesh.update({false, {strip(1, 0, 4), strip(2, 4, 9)}});
  const Mesh whole = join_blocks(mesh.blocks());
  EXPECT_EQ(mesh.triangles(), 18U);
  EXPECT_EQ(whole.triangles.size(), 18U);
  EXPECT_EQ(whole.vertices_mm.size(), 20U) << "the two on the border once";
  EXPECT_EQ(whole.normals.size(), 20U);
  EXPECT_NEAR(area_mm2(whole), 0.9, 1e-5);
}

TEST(WindowMesh, ReplacesRemovesAndClears) {
  WindowMesh mesh;
  mesh.update({false, {strip(1, 0, 4), strip(2, 4, 9)}});
  mesh.update({false, {strip(1, 0, 2)}});
  EXPECT_EQ(mesh.triangles(), 14U);
  MeshBlock gone;
  gone.key = 2;
  mesh.update({false, {gone}});
  EXPECT_NEAR(area_mm2(join_blocks(mesh.blocks())), 0.2, 1e-5);
  mesh.update({true, {strip(3, 5, 6)}});
  EXPECT_EQ(mesh.triangles(), 2U);
  EXPECT_NEAR(area_mm2(join_blocks(mesh.blocks())), 0.1, 1e-5);
}

TEST(WindowMesh, ASnapshotCopiesNoTriangleAndNeverChanges) {
  WindowMesh mesh;
  mesh.update({false, {strip(1, 0, 4), strip(2, 4, 9)}});
  const MeshBlocks before = mesh.blocks(), again = mesh.blocks();
  ASSERT_EQ(before.size(), 2U);
  EXPECT_EQ(before, again) << "the same meshes, not copies of them";
  mesh.update({false, {strip(2, 4, 6)}});
  EXPECT_EQ(mesh.blocks().at(1), before.at(1)) << "what has not changed is shared";
  mesh.update({true, {}});
  EXPECT_TRUE(mesh.blocks().empty());
  EXPECT_NEAR(area_mm2(join_blocks(before)), 0.9, 1e-5)
      << "while the scan goes on an export has what it began with";
}

TEST(WindowMesh, SurvivesBrokenBlocks) {
  MeshBlock broken = strip(1, 0, 3);
  broken.mesh.triangles.emplace_back(0, 1, 99);
  broken.mesh.triangles.emplace_back(-1, 1, 2);
  broken.mesh.vertices_mm[5].z() = std::nanf("");
  WindowMesh mesh;
  mesh.update({false, {broken, strip(2, 3, 5, false)}});
  const Mesh whole = join_blocks(mesh.blocks());
  EXPECT_TRUE(whole.normals.empty()) << "not every block had some";
  for (const Eigen::Vector3i& t : whole.triangles) {
    EXPECT_GE(t.minCoeff(), 0);
    EXPECT_LT(t.maxCoeff(), static_cast<int>(whole.vertices_mm.size()));
  }
}

TEST(Export, WritesStlInMillimetersUnderAFreeName) {
  const test::TemporaryFolder folder;
  WindowMesh mesh;
  mesh.update({false, {strip(1, 0, 9)}});
  test::write_bytes(folder / "mesh_mm_001.stl", "somebody's");
  const auto path = export_path(folder.path(), "stl");
  EXPECT_EQ(path, folder / "mesh_mm_002.stl");
  const ExportOutcome outcome = export_in_background(mesh.blocks(), path).get();
  EXPECT_TRUE(outcome.ok);
  EXPECT_THAT(outcome.sentence, testing::HasSubstr(path.string()));
  EXPECT_NEAR(area_mm2(read_mesh(path, 1.0)), 0.9, 1e-4);
  EXPECT_EQ(test::read_bytes(folder / "mesh_mm_001.stl"), "somebody's");
}

TEST(Export, WritesPlyInMeters) {
  const test::TemporaryFolder folder;
  WindowMesh mesh;
  mesh.update({false, {strip(1, 0, 9)}});
  const auto path = export_path(folder.path(), "ply");
  EXPECT_EQ(path, folder / "mesh_001.ply");
  EXPECT_THAT(export_in_background(mesh.blocks(), path).get().sentence, testing::HasSubstr("in meters"));
  EXPECT_NEAR(area_mm2(read_mesh(path)), 0.9, 1e-4);
  EXPECT_THAT(export_in_background(mesh.blocks(), export_path(folder.path(), "glb")).get().sentence,
              testing::HasSubstr("in meters): " + (folder / "mesh_001.glb").string()));
}

TEST(Export, SaysWhatIsWrong) {
  const test::TemporaryFolder folder;
  EXPECT_FALSE(export_in_background({}, folder / "a.ply").get().ok);
  test::write_bytes(folder / "file", "");
  const ExportOutcome outcome = export_in_background(one_strip(), folder.path() / "file" / "a.ply").get();
  EXPECT_FALSE(outcome.ok);
  EXPECT_THAT(outcome.sentence, testing::HasSubstr("a.ply"));
}

}  // namespace
}  // namespace gelslam::viewer::detail
