#pragma once

#include "gelslam/mesh/mesh.hpp"

namespace gelslam {

struct SimplifiedMesh {
  Mesh mesh;
  double error_mm = 0.0;
};

/// Fewer triangles by edge collapse (Garland & Heckbert 1997, by meshoptimizer) while its error, the root of
/// the quadric error, stays within `max_error_mm`: an estimate of the distance from the full surface; single
/// places may lie further off. Vertices keep their places, normals and confidence, and so does the border.
/// `full` has triangles, and stays as it is where none would be left.
SimplifiedMesh simplify(const Mesh& full, double max_error_mm);

}  // namespace gelslam
