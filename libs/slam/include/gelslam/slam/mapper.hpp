#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <utility>
#include <vector>

#include "gelslam/backend/pose_graph.hpp"
#include "gelslam/core/progress.hpp"
#include "gelslam/loop_closure/loop_closer.hpp"
#include "gelslam/slam/map_snapshot.hpp"
#include "gelslam/slam/slam_map.hpp"
#include "gelslam/slam/slam_options.hpp"

namespace gelslam {

/// The part of the chain behind the tracker: it searches loops for each keyframe and solves the pose graph,
/// with the loops that are known while a scan goes on (optimize()); completely at its end (solve_scan()),
/// which does not depend on how often that was called. Deterministic. Not thread-safe.
class Mapper {
 public:
  explicit Mapper(const SlamOptions& options);

  /// Keyframes in order of their ids, as the tracker hands them out. `search_loops` false leaves out what
  /// takes time: for the last keyframes of a scan that has to end at once. Returns the loops found; a patch
  /// has none.
  std::vector<PoseGraphEdge> add_keyframe(const NewKeyframe& added, bool search_loops = true);

  /// Continues a scan, before the first keyframe: its parts and keyframes with what is known of them. Loops
  /// of keyframes that were not searched yet are searched now, and returned by keyframe. The map has them
  /// from optimize() on.
  std::map<int, std::vector<PoseGraphEdge>> restore(const ScanRecord& record);

  /// Makes the features of restored keyframes, a core's second for 50 of them; else the first search does.
  void remember_places() { loop_closer_.keep(std::exchange(restored_, {})); }

  /// True when loops were found since the last optimize(): solving for all poses may improve the map.
  bool has_new_loops() const { return new_loops_ > 0; }
  /// Solves for all poses and for the gradient scale, and finds how well they are known: tenths of a second
  /// in a large map.
  void optimize();
  /// The map after the last optimize(), and later keyframes where their links put them.
  MapSnapshot snapshot() const;

  /// All that was measured so far, with the parts of restore() and these frames.
  ScanRecord measured(const std::vector<FrameRecord>& frames) const;

 private:
  std::vector<PoseGraphEdge> search_loops(const Keyframe& keyframe);

  SlamOptions options_;
  LoopCloser loop_closer_;
  std::vector<Keyframe> restored_;  // not in loop_closer_ yet: it is slow, and not always needed
  ScanRecord measured_;             // without frames
  MapSnapshot live_;                // nothing is placed
  int new_loops_ = 0;               // since optimize()
};

/// Solves for all poses of what was measured, with refinement (slow; `refine` false: with the edges that are
/// known). `stop_requested` leaves out the rest of the refinement. `progress` (may be null) receives the task
/// "closing loops".
SlamMap solve_scan(ScanRecord scan, const SlamOptions& options, bool refine,
                   const std::function<bool()>& stop_requested, ProgressSink* progress = nullptr);

}  // namespace gelslam
