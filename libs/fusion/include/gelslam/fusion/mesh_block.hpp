#pragma once

#include <cstdint>
#include <vector>

#include "gelslam/mesh/mesh.hpp"

namespace gelslam {

/// A cube of space and the surface in it, so that a growing mesh can be drawn by sending only what changed.
/// Neighboring blocks meet without gaps; vertices on a border may belong to both.
struct MeshBlock {
  std::int64_t key = 0;       ///< the same cube has the same key as long as the map lives
  Mesh mesh;                  ///< map frame, mm; without triangles when the surface has left the cube
  std::vector<int> keyframe;  ///< per vertex: id of the keyframe that sees it best
};

}  // namespace gelslam
