#pragma once

#include "gelslam/mesh/mesh.hpp"

namespace gelslam {

struct SimplifiedMesh {
  Mesh mesh;
  double error_mm = 0.0;
};

/// Simplifies a mesh by edge collapse (Garland & Heckbert 1997, with meshoptimizer) as long as the root of
/// the quadric error stays within `max_error_mm`. This error is an estimate of the distance to the full
/// surface; at single points the distance may be larger. The remaining vertices keep their positions, normals
/// and confidence, and the border does not change. `full` must have triangles; if none would be left, it is
/// returned unchanged.
SimplifiedMesh simplify(const Mesh& full, double max_error_mm);

}  // namespace gelslam
