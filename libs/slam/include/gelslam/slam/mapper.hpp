#pragma once

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

/// The stages after the tracker: searches for loops of each keyframe and solves the pose graph. optimize()
/// solves with the loops that are known so far, while the scan goes on. solve_scan() solves completely at the
/// end; its result does not depend on the earlier calls of optimize(). Deterministic. Not thread-safe.
class Mapper {
 public:
  explicit Mapper(const SlamOptions& options);

  /// Adds a keyframe and returns its loops. Keyframes must be passed in order of their ids, as the tracker
  /// returns them. If `search_loops` is false, the slow search is skipped, for the last keyframes of a scan
  /// that has to end at once. A patch has no loops.
  std::vector<PoseGraphEdge> add_keyframe(const NewKeyframe& added, bool search_loops = true);

  /// Continues a scan; to be called before the first keyframe. Keyframes of the record whose loops were not
  /// searched for yet are searched for now, and their loops are returned by keyframe id. They enter the map
  /// with the next optimize().
  std::map<int, std::vector<PoseGraphEdge>> restore(const ScanRecord& record);

  /// Computes the features of restored keyframes (about 50 per second on one core). If this is not called,
  /// the first search does it.
  void remember_places() { loop_closer_.keep(std::exchange(restored_, {})); }

  /// Says whether loops were found since the last optimize(), so that solving the pose graph may improve the
  /// map.
  bool has_new_loops() const { return new_loops_ > 0; }
  /// Solves the pose graph for all poses and the gradient scale, with covariances. Takes tenths of a second
  /// for a large map.
  void optimize();
  /// Returns the map after the last optimize(), with later keyframes added at the poses that their odometry
  /// edges give.
  MapSnapshot snapshot() const;

  /// Returns everything that was measured so far, including the parts of restore() and the given frames.
  ScanRecord measured(const std::vector<FrameRecord>& frames) const;

 private:
  std::vector<PoseGraphEdge> search_loops(const Keyframe& keyframe);

  SlamOptions options_;
  LoopCloser loop_closer_;
  // Keyframes whose features are not in loop_closer_ yet, because computing them is slow and not always
  // needed.
  std::vector<Keyframe> restored_;
  ScanRecord measured_;  // without frames
  MapSnapshot live_;     // The map without nodes marked as placed.
  int new_loops_ = 0;    // since optimize()
};

/// Solves the pose graph of a whole scan and returns the map. If `refine` is true, overlap edges are searched
/// for first, which is slow; if false, the known edges are used. When `stop_requested` returns true, the rest
/// of the refinement is skipped. `progress` (may be null) receives the task "closing loops".
SlamMap solve_scan(ScanRecord scan, const SlamOptions& options, bool refine,
                   const std::function<bool()>& stop_requested, ProgressSink* progress = nullptr);

}  // namespace gelslam
