#include "gelslam/mesh/mesh_io.hpp"

#include <assimp/postprocess.h>
#include <assimp/scene.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <array>
#include <assimp/Importer.hpp>
#include <cmath>
#include <cstring>
#include <numbers>
#include <string>

#include "../support/temporary_folder.hpp"
#include "gelslam/core/error.hpp"

namespace gelslam {
namespace {

namespace fs = std::filesystem;
using namespace test;

class MeshIo : public ::testing::Test {
 protected:
  fs::path file(const std::string& name) const { return folder_ / name; }
  fs::path file_with(const std::string& name, const std::string& bytes) const {
    write_bytes(file(name), bytes);
    return file(name);
  }
  const TemporaryFolder folder_;
};

/// A tetrahedron about 10 mm large with numbers that are not exact in binary.
Mesh tetrahedron() {
  Mesh mesh;
  mesh.vertices_mm = {{0.1f, 0.2f, 0.3f}, {10.1f, 0.2f, 0.3f}, {0.1f, 9.7f, 0.3f}, {0.1f, 0.2f, -8.3f}};
  mesh.normals = {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}, {0.6f, 0.8f, 0}};
  mesh.confidence = {0.0f, 1.5f, 1e-3f, 12345.678f};
  mesh.triangles = {{0, 1, 2}, {0, 3, 1}, {0, 2, 3}, {1, 3, 2}};
  return mesh;
}

TEST_F(MeshIo, PointsAreLinesOfNumbers) {
  write_mesh(file("m.xyz"), tetrahedron(), LengthUnit::meter);
  std::istringstream numbers(read_bytes(file("m.xyz")));
  for (std::size_t i = 0; i < 4; ++i) {
    Eigen::Vector3f point_m, normal;
    for (float* number : {&point_m.x(), &point_m.y(), &point_m.z(), &normal.x(), &normal.y(), &normal.z()})
      numbers >> *number;
    EXPECT_TRUE((1000 * point_m).isApprox(tetrahedron().vertices_mm[i], 1e-6F)) << i;
    EXPECT_TRUE(normal.isApprox(tetrahedron().normals[i], 1e-5F)) << i;
  }
  EXPECT_TRUE(numbers && numbers.get() == '\n' && numbers.get() == EOF);
  EXPECT_THROW(write_mesh(file("c.xyz"), tetrahedron(), LengthUnit::meter, VertexColors(4)), Error);
}

class MeshIoFormats : public MeshIo,
                      public ::testing::WithParamInterface<std::tuple<const char*, LengthUnit>> {};

/// Corners of every triangle, in order: independent of how vertices are shared or numbered.
TEST_P(MeshIoFormats, RoundTripKeepsEveryTriangle) {
  const auto [extension, unit] = GetParam();
  const Mesh mesh = tetrahedron();
  write_mesh(file(std::string("m") + extension), mesh, unit);
  const Mesh back = read_mesh(file(std::string("m") + extension));  // the unit is noted in the file
  EXPECT_EQ(back.vertices_mm.size(), mesh.vertices_mm.size()) << "STL repeats them";
  EXPECT_EQ(back.normals.empty(), std::string(extension) == ".stl");
  ASSERT_EQ(back.triangles.size(), mesh.triangles.size());
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t)
    for (int c = 0; c < 3; ++c) {
      const auto before = static_cast<std::size_t>(mesh.triangles[t][c]),
                 after = static_cast<std::size_t>(back.triangles[t][c]);
      // Two conversions of a float of 10 mm: a few units in the last place (1e-6 mm each).
      EXPECT_LT((back.vertices_mm[after] - mesh.vertices_mm[before]).norm(), 5e-6f) << t << ", " << c;
      if (!back.normals.empty()) {
        EXPECT_LT((back.normals[after] - mesh.normals[before]).norm(), 1e-5f) << t << ", " << c;
      }
    }
}

INSTANTIATE_TEST_SUITE_P(All, MeshIoFormats,
                         ::testing::Combine(::testing::Values(".ply", ".obj", ".stl", ".PLY"),
                                            ::testing::Values(LengthUnit::meter, LengthUnit::millimeter)),
                         [](const auto& info) {
                           const std::string unit =
                               std::get<1>(info.param) == LengthUnit::meter ? "_m" : "_mm";
                           return std::string(std::get<0>(info.param)).substr(1) + unit;
                         });

TEST_F(MeshIo, PlyKeepsNormalsAndConfidenceExactly) {
  const Mesh mesh = tetrahedron();
  write_mesh(file("m.ply"), mesh);
  const Mesh back = read_mesh(file("m.ply"));
  EXPECT_EQ(back.normals, mesh.normals);
  EXPECT_EQ(back.confidence, mesh.confidence);
  EXPECT_EQ(back.triangles, mesh.triangles);
}

TEST_F(MeshIo, GlbHasTheSurfaceTurnedTowardTheViewerAndLinearColors) {
  const Mesh mesh = tetrahedron();
  const VertexColors srgb = {{255, 0, 0}, {0, 188, 0}, {0, 0, 255}, {10, 10, 10}};
  const std::array<aiColor4D, 4> linear = {aiColor4D(1, 0, 0, 1), aiColor4D(0, 0.5029f, 0, 1),
                                           aiColor4D(0, 0, 1, 1),
                                           aiColor4D(0.003035f, 0.003035f, 0.003035f, 1)};
  write_mesh(file("m.glb"), mesh, LengthUnit::meter, srgb);
  Assimp::Importer importer;
  const aiScene* scene = importer.ReadFile(file("m.glb").string(), aiProcess_PreTransformVertices);
  ASSERT_TRUE(scene != nullptr && scene->mNumMeshes == 1);
  const aiMesh& read = *scene->mMeshes[0];
  ASSERT_EQ(read.mNumFaces, mesh.triangles.size());
  ASSERT_TRUE(read.HasNormals() && read.HasVertexColors(0));
  for (unsigned t = 0; t < read.mNumFaces; ++t)
    for (int c = 0; c < 3; ++c) {
      const unsigned after = read.mFaces[t].mIndices[c];
      const auto before = static_cast<std::size_t>(mesh.triangles[t][c]);
      const auto turned = [](const Eigen::Vector3f& v) { return aiVector3D(v.x(), -v.y(), -v.z()); };
      EXPECT_LT((read.mVertices[after] * 1000.0f - turned(mesh.vertices_mm[before])).Length(), 5e-6f);
      EXPECT_LT((read.mNormals[after] - turned(mesh.normals[before])).Length(), 1e-6f);
      const aiColor4D difference = read.mColors[0][after] - linear[before];
      EXPECT_LT(std::abs(difference.r) + std::abs(difference.g) + std::abs(difference.b), 1e-4f);
    }
}

TEST_F(MeshIo, FilesWithoutANoteAreInTheirUsualUnit) {
  write_mesh(file("m.stl"), tetrahedron(), LengthUnit::millimeter);
  std::string bytes = read_bytes(file("m.stl"));
  bytes.replace(0, 80, std::string(80, ' '));
  const fs::path theirs = file_with("theirs.stl", bytes);
  EXPECT_EQ(noted_unit(theirs), std::nullopt);
  EXPECT_NEAR(read_mesh(theirs).vertices_mm[1].x(), tetrahedron().vertices_mm[1].x(), 1e-5);
  EXPECT_NEAR(read_mesh(theirs, 25.4).vertices_mm[1].x(), 25.4 * tetrahedron().vertices_mm[1].x(), 1e-3);
}

TEST_F(MeshIo, ProgramsThatReadStlAndObjExpectMillimeters) {
  for (const char* name : {"a.stl", "a.OBJ", "a.xyz"})
    EXPECT_EQ(usual_unit(name), LengthUnit::millimeter) << name;
  EXPECT_EQ(usual_unit("a.PLY"), LengthUnit::meter);
  EXPECT_STREQ(short_name(usual_unit("a.stl")), "mm");
}

TEST_F(MeshIo, StlsWithATailOrInCapitalsAreRead) {
  write_mesh(file("good.stl"), tetrahedron());
  const std::string whole = read_bytes(file("good.stl"));
  EXPECT_EQ(bytes_behind_mesh(file("good.stl")), 0u);
  for (const char* header : {"", "solid of another program"}) {
    const std::string headed = header + whole.substr(std::strlen(header)) + std::string(7, 'x');
    const fs::path tail = file_with("tail.stl", headed);
    EXPECT_EQ(bytes_behind_mesh(tail), 7u);
    EXPECT_EQ(read_mesh(tail, 1000.0).vertices_mm, read_mesh(file("good.stl")).vertices_mm);
  }
  const fs::path capitals = file_with(
      "capitals.stl",
      "  SOLID X\nFACET NORMAL 0 0 1\nOUTER LOOP\nVERTEX 0 0 0\nVERTEX 1.5E1 0 0\nVERTEX 0 1 0\nENDLOOP\n"
      "ENDFACET\nENDSOLID X\n");
  EXPECT_EQ(bytes_behind_mesh(capitals), 0u);
  EXPECT_EQ(read_mesh(capitals).vertices_mm[1], Eigen::Vector3f(15, 0, 0));
}

TEST_F(MeshIo, ReadsForeignPlyDialects) {
  const std::string ascii =
      "ply\r\nformat ascii 1.0\r\ncomment made elsewhere\r\nelement vertex 4\r\nproperty double x\r\n"
      "property double y\r\nproperty double z\r\nproperty uchar red\r\nelement face 1\r\n"
      "property list uchar uint vertex_index\r\nproperty float quality\r\nend_header\r\n"
      "0 0 0 255\r\n1 0 0 255\r\n1 1 0 1e0\r\n0 1 0 3\r\n4 0 1 2 3 0.5\r\n";
  const Mesh quad = read_mesh(file_with("quad.ply", ascii), 1.0);
  ASSERT_EQ(quad.triangles.size(), 2u);
  EXPECT_EQ(quad.vertices_mm.size(), 4u);
  EXPECT_FLOAT_EQ(static_cast<float>(area_mm2(quad)), 1);

  std::string big =
      "ply\nformat binary_big_endian 1.0\nelement vertex 3\nproperty short x\nproperty short y\n"
      "property short z\nelement face 1\nproperty list uchar int vertex_indices\nend_header\n";
  for (const int v : {0, 0, 0, 300, 0, 0, 0, -2, 0}) {
    big += static_cast<char>((v >> 8) & 255);
    big += static_cast<char>(v & 255);
  }
  big += std::string("\x03\0\0\0\0\0\0\0\1\0\0\0\2", 13);
  const Mesh triangle = read_mesh(file_with("big.ply", big), 1.0);
  EXPECT_EQ(triangle.vertices_mm[1], Eigen::Vector3f(300, 0, 0));
  EXPECT_EQ(triangle.vertices_mm[2], Eigen::Vector3f(0, -2, 0));
}

/// A star: its corners alternate between two radii. As a polygon and, of half of it, as strips.
TEST_F(MeshIo, ConcaveFacesAndStripsHaveTheirTrueArea) {
  constexpr int kCorners = 10;
  const double area = 0.5 * kCorners * 10 * 4 * std::sin(2 * std::numbers::pi / kCorners);
  std::string
      ply =
          "ply\nformat ascii 1.0\nelement vertex 10\nproperty float x\nproperty float y\nproperty float z\n"
          "element face 1\nproperty list uchar int vertex_indices\nend_header\n",
      obj, face = "10", obj_face = "f";
  for (int i = 0; i < kCorners; ++i) {
    const double angle = 2 * std::numbers::pi * i / kCorners, radius = i % 2 == 0 ? 10 : 4;
    const std::string vertex =
        std::to_string(radius * std::cos(angle)) + " " + std::to_string(radius * std::sin(angle)) + " 1\n";
    ply += vertex;
    obj += "v " + vertex;
    face += " " + std::to_string(i);
    obj_face += " " + std::to_string(i + 1);
  }
  EXPECT_NEAR(area_mm2(read_mesh(file_with("star.ply", ply + face + "\n"), 1.0)), area, 0.01);
  EXPECT_NEAR(area_mm2(read_mesh(file_with("star.obj", obj + obj_face + "\n"), 1.0)), area, 0.01);
  const std::string strips =
      "ply\nformat ascii 1.0\nelement vertex 4\nproperty float x\nproperty float y\nproperty float z\n"
      "element tristrips 1\nproperty list int int vertex_indices\nend_header\n"
      "0 0 0\n1 0 0\n0 1 0\n1 1 0\n8 0 1 2 -1 1 2 3 -1\n";
  EXPECT_NEAR(area_mm2(read_mesh(file_with("strips.ply", strips), 1.0)), 1, 1e-6);
}

TEST_F(MeshIo, ObjsOfOtherProgramsAreRead) {
  for (const char* obj :
       {"\xef\xbb\xbfv 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1\\\n2 3\n",
        "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2\\\r\n3\n",
        "v 0 0 0 1 0.5 0.5 0.5\nv 1 0 0 1 0 0 0\nv 0 1 0 1 0 0 0\nf 1 2 3\n",
        "# C:\\made by\\\nv 0 0 0 # a\nv 1 0 0\nv 0 1 0\nf 1 2 3 # b\n"}) {
    const Mesh mesh = read_mesh(file_with("odd.obj", obj), 1.0);
    EXPECT_EQ(mesh.vertices_mm.size(), 3u) << obj;
    EXPECT_NEAR(area_mm2(mesh), 0.5, 1e-6) << obj;
  }
}

TEST_F(MeshIo, HostilePlyIsRefused) {
  const std::string head = "ply\nformat ascii 1.0\n";
  const std::string xyz = "property float x\nproperty float y\nproperty float z\n";
  const std::string faces = "element face 1\nproperty list uchar int vertex_indices\nend_header\n";
  const std::array<std::string, 14> bad{
      "",
      "ply",
      "not a ply\n",
      head + "element vertex 99999999999999999999999\n" + xyz + faces,
      head + "element vertex 2000000000\n" + xyz + faces + "0 0 0\n",
      head + "element vertex 4000000000\nend_header\n",
      head + "element vertex -1\n" + xyz + faces,
      head + "property float x\nend_header\n",
      head + "element vertex 3\nproperty float x\n" + faces + "0 1 2 3 0 1 2\n",
      head + "element vertex 3\n" + xyz + faces + "0 0 0 1 0 0 0 1 0 3 0 1 3\n",
      head + "element vertex 3\n" + xyz + faces + "0 0 0 1 0 0 0 1 0 3 0 1 -1\n",
      head + "element vertex 3\n" + xyz + faces + "0 0 0 nan 0 0 0 1 0 3 0 1 2\n",
      head + "element vertex 3\n" + xyz + faces + "0 0 0 1 0 0 0 1 0 250 0 1 2\n",
      head + "element vertex 3\nproperty list float int x\n" + faces + "1e30 0 1 2\n"};
  for (const std::string& bytes : bad) EXPECT_THROW(read_mesh(file_with("bad.ply", bytes)), Error) << bytes;
}

TEST_F(MeshIo, VerticesThatCannotBeAreRefusedInEveryFormat) {
  const auto refused = [&](const std::string& name, const std::string& bytes) {
    return message_of([&] { read_mesh(file_with(name, bytes), 1.0); });
  };
  const std::string head =
      "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\n"
      "property float z\nelement face 1\nproperty list uchar int vertex_indices\nend_header\n";
  EXPECT_THAT(refused("far.ply", head + "0 0 0 1e38 0 0 0 1 0 3 0 1 2\n"), ::testing::HasSubstr("unit"));
  EXPECT_THAT(refused("far.obj", "v 0 0 0\nv 1e38 0 0\nv 0 1 0\nf 1 2 3\n"), ::testing::HasSubstr("unit"));
  write_mesh(file("good.stl"), tetrahedron());
  for (const auto& [value, words] : {std::pair{1e38F, "unit"}, {std::nanf(""), "not finite"}}) {
    std::string bytes = read_bytes(file("good.stl"));
    std::memcpy(bytes.data() + 84 + 12, &value, sizeof value);  // the first triangle's first x
    EXPECT_THAT(refused("bad.stl", bytes), ::testing::HasSubstr(words));
  }
}

TEST_F(MeshIo, MistakesAreNamed) {
  EXPECT_THROW(read_mesh(file("absent.ply")), Error);
  EXPECT_THROW(read_mesh(folder_.path()), Error);
  EXPECT_THAT(message_of([&] { read_mesh(file_with("lfs.stl", std::string(kLfsPointer))); }),
              ::testing::HasSubstr(kLfsAdvice));
  EXPECT_THROW(read_mesh(file_with("mesh.txt", "hello")), Error);
  EXPECT_THROW(read_mesh(file_with("text.obj", "hello\n")), Error);
  EXPECT_THROW(read_mesh(file_with("text.stl", "hello\n")), Error);
  EXPECT_THROW(write_mesh(file("mesh.txt"), tetrahedron()), Error);
  EXPECT_THROW(write_mesh(folder_ / "no" / "such" / "folder" / "m.ply", tetrahedron()), Error);
  Mesh broken = tetrahedron();
  broken.triangles[0] = {0, 1, 4};
  EXPECT_THROW(write_mesh(file("broken.ply"), broken), Error);
  EXPECT_FALSE(fs::exists(file("broken.ply")));
}

}  // namespace
}  // namespace gelslam
