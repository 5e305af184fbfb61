#pragma once

#include <cstdint>
#include <vector>

#include "gelslam/core/progress.hpp"
#include "gelslam/core/se3.hpp"
#include "gelslam/mesh/mesh.hpp"
#include "gelslam/surface/stored_surface.hpp"

namespace gelslam {

/// A keyframe's patch at its place in the map.
struct PosedSurface {
  int id = 0;
  Pose map_T_keyframe = Pose::Identity();
  StoredSurface surface;
};

struct FusionOptions {
  double voxel_size_mm = 0.08;  ///< edge of the mesh's cells; about 1.25 pixels of the sensor
  double truncation_mm = 1.0;   ///< sheets of one side less than about 0.85 of this apart become one
  double min_weight = 0.06;     ///< best single weight at which the mesh ends (a clean pixel: 0.95)
  /// islands: shells smaller than this, or that a single keyframe shows beside a larger shell, are left out;
  /// 0 keeps all
  double min_shell_mm2 = 1.0;
  int threads = 0;  ///< 0: all cores; the result does not depend on it
};

/// One surface from many overlapping patches: no stacked sheets, no seams, closed where touched, open
/// elsewhere. Vertices in the map frame, millimeters; normals out of the object (the sensor looks at the
/// object from its outside: against the sensor's +z). The zero set of a weighted mean of projective signed
/// distances, opposite sides of thin objects kept apart by their touch directions (own; docs/algorithms.md).
/// Independent of the patches' order up to rounding; deterministic for a given order. Returns an empty mesh
/// when no patch has contact; throws Error for options that make no sense and for poses that are not finite.
/// `gradient_scale`: heights and slopes are divided by it before (backend/pose_graph.hpp). `progress` (may be
/// null) receives the task "fusing". `islands` (may be null) becomes the number of those left out.
Mesh fuse(const std::vector<PosedSurface>& patches, const FusionOptions& options, double gradient_scale = 1.0,
          ProgressSink* progress = nullptr, std::int64_t* islands = nullptr);

}  // namespace gelslam
