#pragma once

#include <vector>

#include "gelslam/mesh/mesh.hpp"
#include "synthetic_touch.hpp"

namespace gelslam::test {

struct MeshTopology {
  int pieces = 0;              ///< connected by shared vertices
  int boundary_edges = 0;      ///< used by one triangle
  int over_used_edges = 0;     ///< used by more than two: not a manifold
  int inconsistent_edges = 0;  ///< used by two triangles in the same direction
};
MeshTopology topology(const Mesh& mesh);

/// Share of vertices with another sheet of the same side (normals within 90 degrees) above or below: a
/// triangle that the line along the normal meets between 0.5 voxel and `reach_mm` away.
double stacked_share(const Mesh& mesh, double reach_mm);

struct Accuracy {
  double mean_mm = 0, p90_mm = 0, max_mm = 0;
  double bias_mm = 0;  ///< signed mean, positive: the mesh is too large
  double normal_mean_rad = 0, normal_max_rad = 0;
};
Accuracy accuracy(const Mesh& mesh, const Shape& shape);

/// Share of the points that have a vertex within `reach_mm`.
double covered_share(const Mesh& mesh, const std::vector<Eigen::Vector3d>& points, double reach_mm);

}  // namespace gelslam::test
