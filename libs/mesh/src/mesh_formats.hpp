#pragma once

#include <filesystem>
#include <string>
#include <string_view>

#include "gelslam/core/error.hpp"
#include "gelslam/mesh/mesh_io.hpp"

namespace gelslam::mesh::detail {

/// A vertex as a file gives it, in mm. Throws Error when it is not finite or more than 1 km away: floats do
/// not resolve what a sensor feels there.
Eigen::Vector3f vertex_mm(const Eigen::Vector3d& vertex, double mm_per_unit);

/// Whether an STL is text, by its beginning: binary ones may begin with "solid", too.
bool is_text_stl(std::string_view bytes);

/// Reads any PLY (ASCII, little or big endian) whose `vertex` element has x y z and whose `face` element has
/// a list vertex_indices (or vertex_index), or `tristrips`; nx ny nz and confidence are taken when present,
/// other properties are skipped. Assimp makes triangles of polygons. Coordinates are multiplied by
/// `mm_per_unit`. Every count is checked against the file's size before memory is taken for it. Throws Error.
Mesh read_ply(const std::filesystem::path& path, double mm_per_unit);

inline Eigen::Vector3f in_file_unit(const Eigen::Vector3f& v_mm, LengthUnit file_unit) {
  return (v_mm.cast<double>() * (file_unit == LengthUnit::meter ? 1e-3 : 1.0)).cast<float>();
}

#ifdef GELSLAM_WITH_ASSIMP
/// OBJ and STL in all their dialects, and polygons of a PLY; `extension` is ".obj", ".stl" or ".ply". Throws
/// Error when Assimp cannot read the file.
Mesh read_with_assimp(const std::filesystem::path& path, const std::string& extension, double mm_per_unit);

/// The bytes of an OBJ, STL (binary; normals of its triangles) or GLB (as write_mesh() says), by
/// `extension`. Throws Error when Assimp cannot write it.
std::string encode_with_assimp(const Mesh& mesh, const std::string& extension, LengthUnit file_unit,
                               const VertexColors& colors);
#else
inline Mesh read_with_assimp(const std::filesystem::path&, const std::string&, double) {
  throw Error("this build of GelSLAM reads PLY only (GELSLAM_WITH_ASSIMP is off)");
}
inline std::string encode_with_assimp(const Mesh&, const std::string&, LengthUnit, const VertexColors&) {
  throw Error("this build of GelSLAM writes PLY only (GELSLAM_WITH_ASSIMP is off)");
}
#endif

}  // namespace gelslam::mesh::detail
