#pragma once

#include <cstdint>
#include <vector>

#include "scene/scene_geometry.hpp"

namespace gelslam::viewer::detail {

/// Triangles over the mesh's own vertices in which all inner vertices of a cubic cell are one (vertex
/// clustering, after Rossignac & Borrel 1993). Vertices on the mesh's border stay: neighbors meet without
/// gaps whatever their cells.
std::vector<std::uint32_t> cluster_vertices(const DrawableMesh& mesh, float cell_mm);

}  // namespace gelslam::viewer::detail
