#pragma once

#include <filesystem>

#include "gelslam/core/error.hpp"
#include "gelslam/mesh/mesh.hpp"

namespace gelslam::mesh::detail {

/// OBJ and STL in all their dialects. Open3D's failures (a false return, an exception, or a mesh without
/// content) become one Error.
#ifdef GELSLAM_WITH_OPEN3D
Mesh read_with_open3d(const std::filesystem::path& path, double mm_per_unit);
#else
inline Mesh read_with_open3d(const std::filesystem::path&, double) {
  throw Error("this build of GelSLAM reads PLY only (GELSLAM_WITH_OPEN3D is off)");
}
#endif

}  // namespace gelslam::mesh::detail
