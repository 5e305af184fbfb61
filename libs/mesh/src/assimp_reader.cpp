#include <assimp/postprocess.h>
#include <assimp/scene.h>

#include <array>
#include <assimp/Importer.hpp>
#include <map>

#include "gelslam/core/error.hpp"
#include "gelslam/core/files.hpp"
#include "gelslam/core/text.hpp"
#include "mesh_formats.hpp"

namespace gelslam::mesh::detail {
namespace {

/// Groups and materials become one mesh: their vertices end up in one list, each place once. STL repeats
/// every vertex for every triangle, each with the triangle's normal, which is left out.
class OneMesh {
 public:
  OneMesh(Mesh& mesh, double mm_per_unit, bool with_normals)
      : mesh_(mesh), mm_per_unit_(mm_per_unit), with_normals_(with_normals) {}

  void add(const aiMesh& part) {
    for (unsigned i = 0; i < part.mNumFaces; ++i) {
      const aiFace& face = part.mFaces[i];
      if (face.mNumIndices != 3) continue;  // a point or a line
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

/// As Assimp takes an STL: text in small letters, and nothing behind the last triangle.
std::string plain_stl(const std::filesystem::path& path) {
  std::string bytes = read_file(path);
  if (is_text_stl(bytes)) return lower_case(std::move(bytes));
  bytes.resize(bytes.size() - bytes_behind_mesh(path));
  return bytes;
}

}  // namespace

Mesh read_with_assimp(const std::filesystem::path& path, const std::string& extension, double mm_per_unit) {
  Assimp::Importer importer;
  const bool is_stl = extension == ".stl";
  const std::string stl = is_stl ? plain_stl(path) : "";
  const aiScene* scene =
      is_stl ? importer.ReadFileFromMemory(stl.data(), stl.size(), aiProcess_Triangulate, "stl")
             : importer.ReadFile(path.string(), aiProcess_Triangulate);
  if (scene == nullptr) throw Error("it is damaged, or not a mesh of the kind its name says");
  bool with_normals = !is_stl;
  for (unsigned i = 0; i < scene->mNumMeshes; ++i)
    with_normals = with_normals && scene->mMeshes[i]->HasNormals();
  Mesh mesh;
  OneMesh all(mesh, mm_per_unit, with_normals);
  for (unsigned i = 0; i < scene->mNumMeshes; ++i) all.add(*scene->mMeshes[i]);
  return mesh;
}

}  // namespace gelslam::mesh::detail
