#pragma once

#include <filesystem>

#include "gelslam/mesh/mesh.hpp"

namespace gelslam::mesh::detail {

/// Reads any PLY (ASCII, little or big endian) whose `vertex` element has x y z and whose `face` element has
/// a list vertex_indices (or vertex_index); nx ny nz and confidence are taken when present, other properties
/// are skipped. Polygons become fans. Coordinates are multiplied by `mm_per_unit`. Every count is checked
/// against the file's size before memory is taken for it. Throws Error.
Mesh read_ply(const std::filesystem::path& path, double mm_per_unit);

}  // namespace gelslam::mesh::detail
