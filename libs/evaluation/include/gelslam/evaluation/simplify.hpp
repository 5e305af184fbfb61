#pragma once

#include "gelslam/core/progress.hpp"
#include "gelslam/evaluation/triangle_scene.hpp"

namespace gelslam {

/// A mesh with fewer triangles, and how far it is from the full one.
struct SimplifiedMesh {
  Mesh mesh;
  double largest_distance_mm = 0.0;  ///< as largest_distance_mm() below
};

/// The largest distance between two surfaces, both ways: from every vertex of `full` to `simple`, and from
/// points on `simple`, at most `spacing_mm` apart (and a thousand along an edge), to `full`.
double largest_distance_mm(const TriangleScene& full, const TriangleScene& simple, double spacing_mm);

/// As few triangles as stay within `max_error_mm` of `full`, measured by largest_distance_mm() at the mean
/// length of the full mesh's edges: edge collapse (meshoptimizer) with several bounds on its quadric error;
/// where the result is too far off, which few places are, the full mesh stays. Vertices keep their places,
/// normals and confidence, and so does the border. The full mesh where nothing can go. Throws Error for a
/// mesh that TriangleScene refuses.
SimplifiedMesh simplify(const Mesh& full, double max_error_mm, ProgressSink& progress);

}  // namespace gelslam
