#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <vector>

#include "gelslam/backend/pose_graph.hpp"
#include "gelslam/core/stage_timer.hpp"
#include "gelslam/frontend/tracker.hpp"
#include "gelslam/fusion/fusion.hpp"
#include "gelslam/loop_closure/loop_closer.hpp"
#include "gelslam/slam/refinement.hpp"

namespace gelslam {

struct SlamOptions {
  SlamOptions() { pose_graph.estimate_slope_gain = true; }

  TrackerOptions tracker;
  LoopClosureOptions loop_closure;
  PoseGraphOptions pose_graph;
  RefinementOptions refinement;
  CoverageOptions coverage;
  FusionOptions fusion;
};

/// What the log's frames became: light enough to keep one per frame of a long log.
struct FrameRecord {
  std::int64_t frame = 0;
  double time_s = 0;
  TrackStatus status = TrackStatus::no_contact;
  int trial = -1;
  int keyframe = -1;  ///< id; -1 without contact
  Pose keyframe_T_frame = Pose::Identity();
};

/// The map when a scan has ended. Everything is in the sensor frame of `anchor_frame`: the first keyframe of the
/// largest trial group that shows a full contact.
struct SlamMap {
  std::int64_t anchor_frame = -1;     ///< index in the log; -1 when nothing ever touched
  std::vector<FrameRecord> frames;    ///< every frame of the log, in order
  std::vector<std::shared_ptr<const Keyframe>> keyframes;  ///< by id
  std::vector<PoseGraphEdge> edges;
  PoseGraphSolution solution;
  std::vector<bool> in_map;           ///< by keyframe id: belongs to the largest group
  std::vector<int> coverage_keyframes;  ///< ids without which something touched would be missing, ascending
  int trials = 0;
  int groups = 0;
  int loops = 0;                      ///< edges between keyframes found by loop closure and refinement

  Pose group_T_anchor = Pose::Identity();

  Pose anchor_T_keyframe(int id) const { return group_T_anchor.inverse() * solution.group_T_node.at(id); }
  bool has_pose(const FrameRecord& f) const { return f.keyframe >= 0 && in_map[static_cast<std::size_t>(f.keyframe)]; }
};

/// The chain from surfaces to a map: tracker, loop closure, pose graph, refinement, fusion. Frames go in one by one,
/// in order; only keyframes are kept. Deterministic.
class GelSlam {
 public:
  explicit GelSlam(const SlamOptions& options);

  /// Tracks a frame and searches loops for the keyframe it may have made.
  TrackedFrame process(std::int64_t frame, double time_s, SurfacePtr surface, StageTimer& timer);

  /// Notes a frame that has no surface (background).
  void skip(std::int64_t frame, double time_s);

  /// Puts all poses right. May be called at any time; frames may follow.
  SlamMap finish() const;

 private:
  void add_keyframe(const std::shared_ptr<const Keyframe>& keyframe, const KeyframeLink& link);

  SlamOptions options_;
  Tracker tracker_;
  LoopCloser loop_closer_;
  std::vector<FrameRecord> frames_;
  std::vector<std::shared_ptr<const Keyframe>> keyframes_;
  std::map<int, Pose> trial_T_keyframe_;
  std::vector<PoseGraphEdge> edges_;
  int trials_ = 0;
};

/// The patches of the map's largest group at their places, in the anchor's frame.
std::vector<PosedSurface> posed_surfaces(const SlamMap& map);

}  // namespace gelslam
