#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <vector>

#include "gelslam/backend/pose_graph.hpp"
#include "gelslam/core/progress.hpp"
#include "gelslam/loop_closure/loop_closer.hpp"
#include "gelslam/slam/map_snapshot.hpp"
#include "gelslam/slam/slam_map.hpp"
#include "gelslam/slam/slam_options.hpp"

namespace gelslam {

/// The part of the chain behind the tracker: it searches loops for each keyframe and solves the pose graph,
/// with the loops that are known while a scan goes on (optimize()), completely at its end (finish()). The
/// result of finish() does not depend on how often the other was called. Deterministic. Not thread-safe.
class Mapper {
 public:
  explicit Mapper(const SlamOptions& options);

  /// Keyframes in order of their ids, as the tracker hands them out. `search_loops` false leaves out what
  /// takes time: for the last keyframes of a scan that has to end at once. Returns the loops found; a patch
  /// has none.
  std::vector<PoseGraphEdge> add_keyframe(const NewKeyframe& added, bool search_loops = true);

  /// Continues a scan, before the first keyframe: its parts and keyframes with what is known of them. Loops
  /// of keyframes that were not searched yet are searched now, and returned by keyframe.
  std::map<int, std::vector<PoseGraphEdge>> restore(const ScanRecord& record);

  /// True when loops were found since the last optimize(): solving for all poses may improve the map.
  bool has_new_loops() const { return new_loops_ > 0; }
  /// Solves for all poses and for the gradient scale, and finds how well they are known: tenths of a second
  /// in a large map.
  void optimize();
  /// The map after the last optimize(), and later keyframes where their links put them.
  MapSnapshot snapshot() const;

  /// Solves for all poses, with refinement (slow; `refine` false: with the edges that are known). May be
  /// called at any time; keyframes may follow. The map has the parts of restore(). `stop_requested` leaves
  /// out the rest of the refinement. `progress` (may be null) receives the task "closing loops".
  SlamMap finish(const std::vector<FrameRecord>& frames, bool refine,
                 const std::function<bool()>& stop_requested, ProgressSink* progress = nullptr) const;

 private:
  std::vector<PoseGraphEdge> search_loops(const Keyframe& keyframe);
  MapSnapshot chained() const;
  PoseCovariances covariances(const std::vector<PoseGraphEdge>& edges, const PoseGraphSolution& solution,
                              int anchor) const;
  SlamMap measured_map(const std::vector<FrameRecord>& frames) const;

  SlamOptions options_;
  LoopCloser loop_closer_;
  std::vector<Keyframe> restored_;         // not in loop_closer_ yet: it is slow, and not always needed
  ScanRecord measured_;                    // without frames
  std::vector<PoseGraphEdge> live_edges_;  // of measured_.edges, those that shape live_
  MapSnapshot live_;                       // of them; nothing is placed
  int new_loops_ = 0;                      // since optimize()
};

}  // namespace gelslam
