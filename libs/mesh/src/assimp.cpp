#include <assimp/material.h>
#include <assimp/postprocess.h>
#include <assimp/scene.h>
#include <fmt/format.h>

#include <array>
#include <assimp/Exporter.hpp>
#include <assimp/Importer.hpp>
#include <cmath>
#include <cstring>
#include <iterator>
#include <map>
#include <sstream>
#include <vector>

#include "gelslam/core/error.hpp"
#include "gelslam/core/files.hpp"
#include "gelslam/core/text.hpp"
#include "mesh_formats.hpp"

namespace gelslam::mesh::detail {
namespace {

/// Merges groups and materials to one mesh, in which each vertex occurs once. STL repeats every vertex for
/// every triangle with the triangle's normal, which is dropped.
class OneMesh {
 public:
  OneMesh(Mesh& mesh, double mm_per_unit, bool with_normals)
      : mesh_(mesh), mm_per_unit_(mm_per_unit), with_normals_(with_normals) {}

  void add(const aiMesh& part) {
    for (unsigned i = 0; i < part.mNumFaces; ++i) {
      const aiFace& face = part.mFaces[i];
      if (face.mNumIndices != 3) continue;  // Points and lines are skipped.
      const auto vertex = [&](int corner) { return index_of(part, face.mIndices[corner]); };
      mesh_.triangles.emplace_back(vertex(0), vertex(1), vertex(2));
    }
  }

 private:
  int index_of(const aiMesh& part, unsigned i) {
    const aiVector3D& v = part.mVertices[i];
    const Eigen::Vector3f vertex = vertex_mm(Eigen::Vector3d(v.x, v.y, v.z), mm_per_unit_);
    const auto [place, is_new] = index_.try_emplace({v.x, v.y, v.z}, static_cast<int>(index_.size()));
    if (is_new) {
      mesh_.vertices_mm.push_back(vertex);
      if (with_normals_) {
        const aiVector3D& n = part.mNormals[i];
        mesh_.normals.emplace_back(n.x, n.y, n.z);
      }
    }
    return place->second;
  }

  Mesh& mesh_;
  double mm_per_unit_;
  bool with_normals_;
  std::map<std::array<float, 3>, int> index_;
};

/// Prepares an STL for Assimp: text in lower case, and nothing after the last triangle.
std::string plain_stl(const std::filesystem::path& path) {
  std::string bytes = read_file(path);
  if (is_text_stl(bytes)) return lower_case(std::move(bytes));
  bytes.resize(bytes.size() - bytes_behind_mesh(path));
  return bytes;
}

/// Prepares an OBJ for Assimp: removes the byte order mark, comments, and colors after a vertex (some
/// programs add an opacity), and joins continued lines.
std::string plain_obj(const std::filesystem::path& path) {
  std::string text = read_file(path), plain, line;
  if (text.starts_with("\xef\xbb\xbf")) text.erase(0, 3);
  std::istringstream lines(std::move(text));
  for (std::string part; std::getline(lines, part);) {
    line += part.substr(0, part.find_first_of("#\r"));  // A comment may end in a backslash, too.
    if (line.ends_with('\\')) {
      line.back() = ' ';
      if (lines.peek() != EOF) continue;
    }
    std::istringstream words(line);
    std::vector<std::string> numbers{std::istream_iterator<std::string>(words), {}};
    if (numbers.size() > 7 && numbers.front() == "v")
      line = fmt::format("v {} {} {}", numbers[1], numbers[2], numbers[3]);
    plain += line + '\n';
    line.clear();
  }
  return plain;
}

}  // namespace

Mesh read_with_assimp(const std::filesystem::path& path, const std::string& extension, double mm_per_unit) {
  Assimp::Importer importer;
  const bool is_stl = extension == ".stl";
  const std::string bytes = is_stl                ? plain_stl(path)
                            : extension == ".obj" ? plain_obj(path)
                                                  : read_file(path);
  const aiScene* scene = importer.ReadFileFromMemory(bytes.data(), bytes.size(), aiProcess_Triangulate,
                                                     extension.substr(1).c_str());
  if (scene == nullptr) throw Error("it is damaged, or not a mesh of the kind its name says");
  bool with_normals = !is_stl;
  for (unsigned i = 0; i < scene->mNumMeshes; ++i)
    with_normals = with_normals && scene->mMeshes[i]->HasNormals();
  Mesh mesh;
  OneMesh all(mesh, mm_per_unit, with_normals);
  for (unsigned i = 0; i < scene->mNumMeshes; ++i) all.add(*scene->mMeshes[i]);
  return mesh;
}

namespace {

constexpr ai_real kTouched = 0.75;  ///< Gray level of a surface without colors.

aiVector3D vector_of(const Eigen::Vector3f& v) { return {v.x(), v.y(), v.z()}; }

/// Returns the linear intensity of an sRGB level (IEC 61966-2-1).
ai_real linear_share(std::uint8_t level) {
  const double s = level / 255.0;
  return static_cast<ai_real>(s <= 0.04045 ? s / 12.92 : std::pow((s + 0.055) / 1.055, 2.4));
}

aiMesh* part_of(const Mesh& mesh, LengthUnit file_unit, bool with_normals, const VertexColors& colors) {
  const std::size_t n = mesh.vertices_mm.size();
  auto* const part = new aiMesh;
  part->mPrimitiveTypes = aiPrimitiveType_TRIANGLE;
  part->mNumVertices = static_cast<unsigned>(n);
  part->mVertices = new aiVector3D[n];
  for (std::size_t i = 0; i < n; ++i)
    part->mVertices[i] = vector_of(in_file_unit(mesh.vertices_mm[i], file_unit));
  if (with_normals && !mesh.normals.empty()) {
    part->mNormals = new aiVector3D[n];
    for (std::size_t i = 0; i < n;
         // glTF requires unit length, so a normal without direction becomes that of the untouched gel.
         ++i) {
      const Eigen::Vector3f& normal = mesh.normals[i];
      part->mNormals[i] = normal.norm() > 0 ? vector_of(normal.normalized()) : aiVector3D(0, 0, -1);
    }
  }
  if (!colors.empty()) {
    part->mColors[0] = new aiColor4D[n];
    for (std::size_t i = 0; i < n; ++i) {
      const auto& [red, green, blue] = colors[i];
      part->mColors[0][i] = {linear_share(red), linear_share(green), linear_share(blue), 1};
    }
  }
  part->mNumFaces = static_cast<unsigned>(mesh.triangles.size());
  part->mFaces = new aiFace[mesh.triangles.size()];
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
    part->mFaces[t].mNumIndices = 3;
    part->mFaces[t].mIndices = new unsigned[3];
    for (int c = 0; c < 3; ++c) part->mFaces[t].mIndices[c] = static_cast<unsigned>(mesh.triangles[t][c]);
  }
  return part;
}

aiMaterial* material(bool has_colors) {
  const ai_real gray = has_colors ? 1 : kTouched, metallic = 0, roughness = ai_real(0.6);
  const aiColor4D base(gray, gray, gray, 1);
  const int two_sided = 1;
  auto* const made = new aiMaterial;
  made->AddProperty(&base, 1, AI_MATKEY_BASE_COLOR);
  made->AddProperty(&metallic, 1, AI_MATKEY_METALLIC_FACTOR);
  made->AddProperty(&roughness, 1, AI_MATKEY_ROUGHNESS_FACTOR);
  made->AddProperty(&two_sided, 1, AI_MATKEY_TWOSIDED);
  return made;
}

}  // namespace

std::string encode_with_assimp(const Mesh& mesh, const std::string& extension, LengthUnit file_unit,
                               const VertexColors& colors) {
  const bool is_gltf = extension == ".glb", is_stl = extension == ".stl";
  aiScene scene;  // Owns everything that it points to.
  scene.mRootNode = new aiNode("surface");
  scene.mRootNode->mNumMeshes = 1;
  scene.mRootNode->mMeshes = new unsigned[1]{0};
  if (is_gltf)
    scene.mRootNode->mTransformation = aiMatrix4x4(1, 0, 0, 0, 0, -1, 0, 0, 0, 0, -1, 0, 0, 0, 0, 1);
  scene.mNumMeshes = 1;
  scene.mMeshes = new aiMesh* [1] { part_of(mesh, file_unit, !is_stl, colors) };
  scene.mNumMaterials = 1;
  scene.mMaterials = new aiMaterial* [1] { material(!colors.empty()) };
  Assimp::Exporter exporter;
  const aiExportDataBlob* const file = exporter.ExportToBlob(&scene, is_gltf  ? "glb2"
                                                                     : is_stl ? "stlb"
                                                                              : "objnomtl");
  if (file == nullptr) throw Error(exporter.GetErrorString());
  return {static_cast<const char*>(file->data), file->size};
}

}  // namespace gelslam::mesh::detail
