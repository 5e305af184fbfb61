#pragma once

#include <cstdint>
#include <vector>

#include "scene_geometry.hpp"

namespace gelslam::viewer::detail {

/// Triangles over the mesh's own vertices in which all vertices of a cubic cell are one (vertex clustering,
/// after Rossignac & Borrel 1993). Cells lie on a grid fixed in space, and a cell that holds vertices of the
/// mesh's border is represented by one of those, chosen by place alone: neighbouring meshes that share border
/// vertices still meet.
std::vector<std::uint32_t> cluster_vertices(const DrawableMesh& mesh, float cell_mm);

}  // namespace gelslam::viewer::detail
