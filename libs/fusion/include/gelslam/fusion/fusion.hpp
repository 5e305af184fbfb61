#pragma once

#include <cstdint>
#include <vector>

#include "gelslam/core/progress.hpp"
#include "gelslam/core/se3.hpp"
#include "gelslam/mesh/mesh.hpp"
#include "gelslam/surface/stored_surface.hpp"

namespace gelslam {

/// The surface of a keyframe with its pose in the map.
struct PosedSurface {
  int id = 0;
  Pose map_T_keyframe = Pose::Identity();
  StoredSurface surface;
};

struct FusionOptions {
  double voxel_size_mm = 0.08;  ///< Edge length of the mesh's cells; about 1.25 pixels of the sensor.
  /// Distance at which the signed distances are cut off. Two sheets of the same side merge if they are closer
  /// than about 0.85 of it.
  double truncation_mm = 1.0;
  /// The mesh ends where the largest weight of a single patch falls to this value; in the middle of a patch
  /// it is 0.95.
  double min_weight = 0.06;
  /// Shells of the mesh smaller than this are left out as islands, as are shells that only a single keyframe
  /// shows beside a larger shell. 0 keeps all.
  double min_shell_mm2 = 1.0;
  int threads = 0;  ///< 0: all cores. The result does not depend on it.
};

/// Fuses overlapping patches to one surface without duplicate sheets or seams, closed where the object was
/// touched and open elsewhere. Vertices are in the map frame (mm). Normals point out of the object, against
/// the sensor's +z axis. The surface is the zero set of a weighted mean of projective signed distances;
/// opposite sides of a thin object are told apart by the directions from which they were touched (not in the
/// paper; docs/algorithms.md). The result does not depend on the order of the patches, except for rounding,
/// and is deterministic for a given order. Returns an empty mesh when no patch has contact. Throws Error for
/// options out of range and for poses that are not finite. Heights and slopes are divided by `gradient_scale`
/// first (backend/uncertain_motion.hpp). `progress` (may be null) receives the task "fusing". `islands` (may
/// be null) receives the number of islands that were left out.
Mesh fuse(const std::vector<PosedSurface>& patches, const FusionOptions& options, double gradient_scale = 1.0,
          ProgressSink* progress = nullptr, std::int64_t* islands = nullptr);

}  // namespace gelslam
