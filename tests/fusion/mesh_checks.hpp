#pragma once

#include <array>
#include <cstdint>
#include <map>
#include <vector>

#include "gelslam/fusion/incremental_fusion.hpp"
#include "gelslam/mesh/mesh.hpp"
#include "synthetic_touch.hpp"

namespace gelslam::test {

struct MeshTopology {
  int pieces = 0;              ///< connected by shared vertices
  int boundary_edges = 0;      ///< used by one triangle
  int over_used_edges = 0;     ///< used by more than two: not a manifold
  int inconsistent_edges = 0;  ///< used by two triangles in the same direction
  double boundary_mm = 0;      ///< length of the border
  int euler_number = 0;  ///< vertices - edges + triangles: 1 for a sheet without holes, one less for each
};
MeshTopology topology(const Mesh& mesh);

/// Share of vertices with another sheet of the same side (normals within 90 degrees) above or below: a
/// triangle that the line along the normal meets between 0.5 voxel and `reach_mm` away.
double stacked_share(const Mesh& mesh, double reach_mm);

struct Accuracy {
  double mean_mm = 0, max_mm = 0;
  double normal_mean_rad = 0;
};
Accuracy accuracy(const Mesh& mesh, const Field& field);

/// Share of the points that lie within `reach_mm` of the mesh.
double covered_share(const Mesh& mesh, const std::vector<Eigen::Vector3d>& points, double reach_mm);

/// What a viewer that takes all changes shows. Expects that each call names a block once, in order, and never
/// says that a block is empty that was not shown.
class Shown {
 public:
  void take(IncrementalFusion& fusion);
  /// Works until nothing is left, taking all the way.
  void finish(IncrementalFusion& fusion);
  /// The same of these patches.
  void show(IncrementalFusion& fusion, const std::vector<PosedSurface>& patches, double gradient_scale);

  const std::map<std::int64_t, MeshBlock>& blocks() const { return blocks_; }
  int changes() const { return changes_; }

 private:
  std::map<std::int64_t, MeshBlock> blocks_;
  int changes_ = 0;
};

/// Position, normal and confidence of three corners, beginning with the smallest: the same triangle is the
/// same whatever its vertices are called.
using Facet = std::array<std::array<float, 7>, 3>;

/// Sorted.
std::vector<Facet> facets_of(const Mesh& mesh);
std::vector<Facet> facets_of(const Shown& shown);

/// All blocks as one mesh: vertices at exactly the same place are one, and are expected to have one normal.
Mesh welded(const Shown& shown);

}  // namespace gelslam::test
