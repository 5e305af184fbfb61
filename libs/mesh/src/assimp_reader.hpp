#pragma once

#include <filesystem>
#include <string>

#include "gelslam/core/error.hpp"
#include "gelslam/mesh/mesh.hpp"

namespace gelslam::mesh::detail {

/// OBJ and STL in all their dialects; `extension` is ".obj" or ".stl". Throws Error when Assimp cannot read
/// the file.
#ifdef GELSLAM_WITH_ASSIMP
Mesh read_with_assimp(const std::filesystem::path& path, const std::string& extension, double mm_per_unit);
#else
inline Mesh read_with_assimp(const std::filesystem::path&, const std::string&, double) {
  throw Error("this build of GelSLAM reads PLY only (GELSLAM_WITH_ASSIMP is off)");
}
#endif

}  // namespace gelslam::mesh::detail
