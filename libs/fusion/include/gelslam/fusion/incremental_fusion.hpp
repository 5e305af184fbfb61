#pragma once

#include <memory>
#include <vector>

#include "gelslam/fusion/fusion.hpp"

namespace gelslam {

struct IncrementalOptions {
  /// A patch is moved in the mesh when its center or a corner has moved by more than this since it was put
  /// there, or the gradient scale by more than max_scale_change (a share). 0: at any change.
  double max_displacement_mm = 0.02;  // The mesh that is saved is made of the poses as they are.
  double max_scale_change = 0.005;
  int warm_blocks = 4096;  ///< blocks whose sums are kept ready for the next patch: 6 or 12 kB each
};

/// The surface of fuse() while it grows: patches come, move and go, and only the blocks they pass through are
/// made again, from the same field by the same mesher. When work() has nothing left to do, the blocks
/// together are the mesh of fuse() for the poses in use, with the same vertices and triangles, whatever
/// happened before; only islands are still there. Not thread-safe; all but finish() runs
/// in the calling thread (`FusionOptions::threads` is not used).
class IncrementalFusion {
 public:
  /// Throws Error for options that make no sense.
  IncrementalFusion(const FusionOptions& fusion, const IncrementalOptions& options);
  ~IncrementalFusion();

  /// Sets all patches and their places; those no longer named are removed. The work is done by work(). Keeps
  /// the surfaces. Throws Error, and changes nothing, when an id is given twice, a patch is damaged (as
  /// fuse() does), or the scale is not a positive number.
  void set_patches(const std::vector<PosedSurface>& patches, double gradient_scale);

  /// One round of work, some tens of milliseconds; true while there may be more to do. New patches first,
  /// newest first, then what has moved or gone. Throws Error when a patch reaches too far from the map's
  /// origin; that patch is then left out.
  bool work();

  /// Does all work that is left, on `threads` threads (0: all cores), and returns the whole surface as one
  /// mesh with shared vertices, without islands (FusionOptions::min_shell_mm2): the end of fuse(). The same
  /// bytes for any number of threads and any history. It must be the last call. Throws Error like work().
  /// `progress` (may be null) receives the task "fusing".
  Mesh finish(int threads, double min_shell_mm2, ProgressSink* progress = nullptr,
              std::int64_t* islands = nullptr);

  /// Blocks whose surface has changed since the last call, by key. Together with all taken before they meet
  /// without gaps, also while there is work left (where a large correction has come half way there is a step,
  /// and walls are left out as in fuse()).
  std::vector<MeshBlock> take_changed_blocks();

 private:
  class Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace gelslam
