#include <assimp/material.h>
#include <assimp/scene.h>

#include <assimp/Exporter.hpp>
#include <cmath>

#include "gelslam/core/error.hpp"
#include "mesh_formats.hpp"

namespace gelslam::mesh::detail {
namespace {

constexpr ai_real kTouched = 0.75;  ///< gray of a surface without colors

aiVector3D vector_of(const Eigen::Vector3f& v) { return {v.x(), v.y(), v.z()}; }

/// The linear intensity of an sRGB level (IEC 61966-2-1).
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
         ++i) {  // glTF demands unit length: without direction, that of untouched gel
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
  aiScene scene;  // owns what it points to
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
