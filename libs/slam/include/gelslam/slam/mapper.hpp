#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <vector>

#include "gelslam/backend/pose_graph.hpp"
#include "gelslam/frontend/tracker.hpp"
#include "gelslam/loop_closure/loop_closer.hpp"
#include "gelslam/slam/map_snapshot.hpp"
#include "gelslam/slam/slam_map.hpp"
#include "gelslam/slam/slam_options.hpp"

namespace gelslam {

/// The half of the chain behind the tracker: keyframes go in, loops are searched for each of them, and the
/// pose graph says where they are: roughly and at once while a scan goes on, as well as it can at the end.
/// What finish() says does not depend on how often update() was called. Deterministic. Not thread-safe.
class Mapper {
 public:
  explicit Mapper(const SlamOptions& options);

  /// Keyframes in order of their ids, as the tracker hands them out. `search_loops` false leaves out what
  /// takes time: for the last keyframes of a scan that has to end at once.
  void add_keyframe(const NewKeyframe& added, bool search_loops = true);

  /// Takes back the keyframes of this trial and of later ones.
  void forget_from_trial(int trial);

  /// True when loops were found since the last settle(): all poses may be better than they are.
  bool unsettled() const { return loops_since_settled_ > 0; }
  /// Puts the newest keyframes in place, and moves others only where a loop pulls: milliseconds.
  void update();
  /// Solves for all poses and for the slopes' gain: tenths of a second in a large map.
  void settle();
  /// What update() and settle() have found.
  MapSnapshot snapshot() const;

  /// Puts all poses right, with refinement (slow; `refine` false: with the edges that are known). May be
  /// called at any time; keyframes may follow. `stop_requested` leaves out the rest of the refinement.
  SlamMap finish(const std::vector<FrameRecord>& frames, bool refine,
                 const std::function<bool()>& stop_requested) const;

 private:
  SlamOptions options_;
  LoopCloser loop_closer_;
  std::vector<std::shared_ptr<const Keyframe>> keyframes_;  // by id; null where taken back
  std::map<int, Pose> trial_T_keyframe_;                    // the nodes
  std::vector<PoseGraphEdge> edges_;                        // all that were measured
  std::vector<PoseGraphEdge> live_edges_;                   // those of them that shape live_
  PoseGraphSolution live_;
  int loops_since_settled_ = 0;
  std::uint64_t version_ = 0;
};

}  // namespace gelslam
