#pragma once

#include "gelslam/mesh/mesh.hpp"

namespace gelslam::fusion::detail {

/// Drops connected pieces (by shared vertices) whose area is below `min_area_mm2`, and vertices that no
/// triangle uses. Order is kept.
Mesh without_small_pieces(const Mesh& mesh, double min_area_mm2);

}  // namespace gelslam::fusion::detail
