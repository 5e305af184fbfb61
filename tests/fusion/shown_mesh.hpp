#pragma once

#include <array>
#include <cstdint>
#include <map>
#include <vector>

#include "gelslam/fusion/incremental_fusion.hpp"

namespace gelslam::test {

/// What a viewer that takes all changes shows. Expects that each call names a block once, in order, and never
/// says that a block is empty that was not shown.
class Shown {
 public:
  void take(IncrementalFusion& fusion);
  /// Works until nothing is left, taking all the way.
  void finish(IncrementalFusion& fusion);

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

/// Vertices - edges + triangles: 1 for a sheet without holes, one less for every hole.
int euler_number(const Mesh& mesh);

}  // namespace gelslam::test
