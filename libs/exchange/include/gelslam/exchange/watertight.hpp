#pragma once

#include "gelslam/core/progress.hpp"
#include "gelslam/mesh/mesh.hpp"

namespace gelslam {

/// A surface made anew without gaps. It has normals; and confidence where the source has it, 0 where nothing
/// was touched.
struct WatertightMesh {
  Mesh mesh;
  double touched_share = 0.0;  ///< share of the area within `reach_mm` of the source
  double reach_mm = 0.0;       ///< four cells of the octree
  double volume_mm3 = 0.0;     ///< of the body; 0 where the surface is open
};

/// Screened Poisson reconstruction (Kazhdan & Hoppe 2013; Open3D) of points on `touched` with its normals, or
/// those of its triangles where it has none. Cells of the octree are at most as wide as
/// typical_edge_mm(), within 1/128 to 1/4096 of the extent.
///
/// `close` false: gaps up to 2 `reach_mm` wide are filled; the surface ends `reach_mm` beyond the source.
/// `close` true: a closed body, edge-manifold, of positive volume. Where nothing was touched the surface goes
/// on smoothly; where it then does not close (a surface touched from one side), it goes on along the convex
/// hull of the source and of the source moved inward by a tenth of its largest extent.
///
/// The same bytes for any number of threads. Throws Error for a mesh that TriangleScene refuses, that has too
/// little area or too much detail, or whose triangles do not face outward, and when memory does not suffice.
WatertightMesh make_watertight(const Mesh& touched, bool close, ProgressSink& progress);

}  // namespace gelslam
