#pragma once

#include "gelslam/core/progress.hpp"
#include "gelslam/mesh/mesh.hpp"

namespace gelslam {

/// A surface without gaps, made from a mesh. It has normals, and confidence if the source has it, which is 0
/// where nothing was touched.
struct WatertightMesh {
  Mesh mesh;
  double touched_share = 0.0;  ///< Fraction of the area within `reach_mm` of the source.
  double reach_mm = 0.0;       ///< Width of four cells of the octree.
  double volume_mm3 = 0.0;     ///< Volume of the closed body; 0 if the surface is open.
};

/// Reconstructs a surface from points sampled on `touched`, by screened Poisson reconstruction (Kazhdan &
/// Hoppe 2013; Open3D), with the mesh's normals or, if it has none, those of its triangles. Cells of the
/// octree are at most as wide as typical_edge_mm(), within 1/128 to 1/4096 of the extent.
///
/// If `close` is false, gaps up to 2 `reach_mm` wide are filled, and the surface ends `reach_mm` beyond the
/// source. If `close` is true, the result is a closed, edge-manifold body of positive volume: where nothing
/// was touched, the surface is continued smoothly. If it does not close in this way (an object touched from
/// one side only), it is continued along the convex hull of the source and of the source moved inward by a
/// tenth of its largest extent.
///
/// The result does not depend on the number of threads. Throws Error for a mesh that TriangleScene refuses,
/// that has too little area or too much detail, or whose triangles do not face outward, and when the memory
/// does not suffice.
WatertightMesh make_watertight(const Mesh& touched, bool close, ProgressSink& progress);

}  // namespace gelslam
