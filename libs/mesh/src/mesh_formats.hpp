#pragma once

#include <filesystem>
#include <string>
#include <string_view>

#include "gelslam/core/error.hpp"
#include "gelslam/mesh/mesh_io.hpp"

namespace gelslam::mesh::detail {

/// Converts a vertex of a file to mm. Throws Error when it is not finite or more than 1 km away, where single
/// precision does not resolve what a sensor feels.
Eigen::Vector3f vertex_mm(const Eigen::Vector3d& vertex, double mm_per_unit);

/// Says whether an STL is text, by its beginning. Binary files may begin with "solid", too.
bool is_text_stl(std::string_view bytes);

/// Reads a PLY (ASCII, little or big endian) whose `vertex` element has x y z and whose `face` element has a
/// list vertex_indices (or vertex_index), or that has `tristrips`. nx ny nz and confidence are read if
/// present, other properties are skipped. Assimp converts polygons to triangles. Coordinates are multiplied
/// by `mm_per_unit`. Every count is compared with the file's size before memory is allocated for it. Throws
/// Error.
Mesh read_ply(const std::filesystem::path& path, double mm_per_unit);

inline Eigen::Vector3f in_file_unit(const Eigen::Vector3f& v_mm, LengthUnit file_unit) {
  return (v_mm.cast<double>() * (file_unit == LengthUnit::meter ? 1e-3 : 1.0)).cast<float>();
}

#ifdef GELSLAM_WITH_ASSIMP
/// Reads OBJ and STL in all their variants, and polygons of a PLY; `extension` is ".obj", ".stl" or ".ply".
/// Throws Error when Assimp cannot read the file.
Mesh read_with_assimp(const std::filesystem::path& path, const std::string& extension, double mm_per_unit);

/// Returns the bytes of an OBJ, STL (binary, with the normals of its triangles) or GLB (see write_mesh()), by
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
