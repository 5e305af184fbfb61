#pragma once

#include <memory>
#include <vector>

#include "gelslam/fusion/fusion.hpp"

namespace gelslam {

struct IncrementalOptions {
  /// A patch is fused again at its new pose when its center or a corner has moved by more than this since it
  /// was fused, or when the gradient scale has changed by more than max_scale_change (relative). 0: at any
  /// change.
  double max_displacement_mm = 0.02;  // The saved mesh is not affected: it is fused with the exact poses.
  double max_scale_change = 0.005;
  /// Number of blocks whose sums are kept in memory for the next patch; each takes 6 or 12 kB.
  int warm_blocks = 4096;
};

/// The surface of fuse() for a map that grows: patches can be added, moved and removed, and only the blocks
/// that they touch are computed again. When work() has nothing left to do, all blocks together have the same
/// vertices and triangles as the mesh of fuse() for the current poses, whatever happened before, except that
/// islands are included. Not thread-safe. All functions but finish() run in the calling thread
/// (`FusionOptions::threads` is not used).
class IncrementalFusion {
 public:
  /// Throws Error for options out of range.
  IncrementalFusion(const FusionOptions& fusion, const IncrementalOptions& options);
  ~IncrementalFusion();

  /// Sets all patches and their poses; patches that are not in the list are removed. The surfaces are kept,
  /// and the work is done by work(). Throws Error, and changes nothing, when an id occurs twice, when a patch
  /// is damaged (as fuse() does), or when the scale is not a positive number.
  void set_patches(const std::vector<PosedSurface>& patches, double gradient_scale);

  /// Does a part of the work, which takes some tens of milliseconds. Returns true while there may be more to
  /// do. New patches come first, beginning with the newest, then those that were moved or removed. Throws
  /// Error when a patch is too far from the map's origin; that patch is then left out.
  bool work();

  /// Does all work that is left on `threads` threads (0: all cores) and returns the whole surface as one mesh
  /// with shared vertices, without islands (FusionOptions::min_shell_mm2). This is the last step of fuse(),
  /// and its result does not depend on the number of threads or on earlier calls. It must be the last call.
  /// Throws Error as work(). `progress` (may be null) receives the task "fusing".
  Mesh finish(int threads, double min_shell_mm2, ProgressSink* progress = nullptr,
              std::int64_t* islands = nullptr);

  /// Returns the blocks whose surface has changed since the last call, by key. Together with the blocks
  /// returned before they form a surface without gaps, even while work is left. After a large correction
  /// there may temporarily be a step where blocks are not updated yet.
  std::vector<MeshBlock> take_changed_blocks();

 private:
  class Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace gelslam
