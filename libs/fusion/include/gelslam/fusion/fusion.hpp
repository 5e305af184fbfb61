#pragma once

#include <vector>

#include "gelslam/core/se3.hpp"
#include "gelslam/mesh/mesh.hpp"
#include "gelslam/surface/surface.hpp"

namespace gelslam {

/// A keyframe's patch at its place in the map.
struct PosedSurface {
  int id = 0;
  Pose map_T_keyframe = Pose::Identity();
  SurfacePtr surface;
};

struct FusionOptions {
  double slope_gain = 1.0;  ///< heights and slopes are divided by this before fusing (backend/pose_graph.hpp)
};

/// One surface from many overlapping patches: no stacked sheets, no seams, closed where touched, open elsewhere.
/// Vertices in the map frame, millimetres; normals out of the object (the sensor looks at the object from its
/// outside: against the sensor's +z). Deterministic. Returns an empty mesh when no patch has contact.
Mesh fuse(const std::vector<PosedSurface>& patches, const FusionOptions& options);

}  // namespace gelslam
