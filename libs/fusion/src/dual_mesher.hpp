#pragma once

#include "blocks.hpp"
#include "field.hpp"
#include "gelslam/mesh/mesh.hpp"

namespace gelslam::fusion::detail {

/// The field's zero set as an indexed mesh: a vertex in every cell that the surface passes through, moved
/// onto the zero set, a quadrilateral (two triangles) around every lattice edge that it crosses. Open where a
/// corner is unobserved. Deterministic, whatever the number of threads.
Mesh extract_zero_set(const BlockGrid& grid, const Field& field, float voxel_size_mm, int threads);

}  // namespace gelslam::fusion::detail
