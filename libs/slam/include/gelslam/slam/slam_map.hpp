#pragma once

#include <cstdint>
#include <vector>

#include "gelslam/backend/pose_covariance.hpp"
#include "gelslam/core/run_report.hpp"
#include "gelslam/core/trajectory.hpp"
#include "gelslam/frontend/tracker.hpp"
#include "gelslam/fusion/fusion.hpp"
#include "gelslam/slam/map_snapshot.hpp"
#include "gelslam/slam/scan_record.hpp"
#include "gelslam/surface/surface.hpp"

namespace gelslam {

/// The map at the end of a scan: the measurements, and the solution computed from them. Poses of the map are
/// in the sensor frame of `anchor_frame`, which is the first keyframe of the map with a full contact. A map
/// that was not made by a scan contains keyframes only.
struct SlamMap : ScanRecord {
  std::int64_t anchor_frame = -1;  ///< Index in the log; -1 if there was never contact.
  /// The consistent ones of `edges`, and the overlap edges found at the end.
  std::vector<PoseGraphEdge> solved_edges;
  PoseGraphSolution solution;   ///< of solved_edges
  PoseCovariances covariances;  ///< Covariances relative to the anchor.
  /// By keyframe id: whether it belongs to the map, which is the group of keyframes with determined relative
  /// poses that was the largest at the end of the first part.
  std::vector<bool> in_map;
  int trials = 0;
  int components = 0;
  int loops = 0;  ///< Number of edges found by loop closure and refinement.
  RunReport::Uncertainty uncertainty;

  Pose component_T_anchor = Pose::Identity();

  GradientScale gradient_scale() const { return gradient_scale_of(solution.shared_unknowns); }
  Pose anchor_T_keyframe(int id) const {
    return component_T_anchor.inverse() * solution.component_T_node.at(id);
  }
  /// Poses of all frames that have one, in the map's frame, with their covariances.
  std::vector<StampedPose> trajectory() const;
  /// Says whether the frame was tracked and its keyframe is in the map. A lost frame that begins a trial has
  /// a keyframe, but was not tracked.
  bool has_pose(const FrameRecord& f) const {
    return f.status == TrackStatus::tracked && f.keyframe >= 0 &&
           in_map[static_cast<std::size_t>(f.keyframe)];
  }
};

/// Makes a snapshot of a pose graph's solution, in which no node is marked as placed. Without covariances
/// every pose counts as exact.
MapSnapshot snapshot_of(const ScanRecord& scan, const std::vector<PoseGraphEdge>& edges,
                        const PoseGraphSolution& solution, PoseCovariances covariances);
/// Marks keyframes as placed and shown. `placed` is indexed by keyframe id.
void show(MapSnapshot& map, const std::vector<bool>& placed);
/// Returns the map as a window shows it. Poses of the shown component are in the anchor's frame.
MapSnapshot snapshot_of(const SlamMap& map);

/// Returns all placed surfaces with their poses in the frame of the map.
std::vector<PosedSurface> posed_surfaces(const MapSnapshot& map);

}  // namespace gelslam
