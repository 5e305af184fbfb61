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

/// The map when a scan has ended: what was measured, and what follows. Everything is in the sensor frame of
/// `anchor_frame`: the first keyframe of the map that shows a full contact. A map that no
/// scan has measured has keyframes alone.
struct SlamMap : ScanRecord {
  std::int64_t anchor_frame = -1;           ///< index in the log; -1 when nothing ever touched
  std::vector<PoseGraphEdge> solved_edges;  ///< consistent ones of `edges`, and those found at the end
  PoseGraphSolution solution;               ///< of solved_edges
  PoseCovariances covariances;              ///< of the solution, relative to the anchor
  std::vector<bool> in_map;  ///< by keyframe id: of those whose places are known, the group that was
                             ///< largest when the first part ended
  int trials = 0;
  int components = 0;
  int loops = 0;  ///< edges between keyframes found by loop closure and refinement
  RunReport::Uncertainty uncertainty;

  Pose component_T_anchor = Pose::Identity();

  GradientScale gradient_scale() const { return gradient_scale_of(solution.shared_unknowns); }
  Pose anchor_T_keyframe(int id) const {
    return component_T_anchor.inverse() * solution.component_T_node.at(id);
  }
  /// Poses of all frames that have one, in the map's frame, with their covariances.
  std::vector<StampedPose> trajectory() const;
  /// Tracked, in the map. A lost frame that begins a trial has a keyframe, but is not tracked.
  bool has_pose(const FrameRecord& f) const {
    return f.status == TrackStatus::tracked && f.keyframe >= 0 &&
           in_map[static_cast<std::size_t>(f.keyframe)];
  }
};

/// A solution of `edges`, of which nothing is placed. Without covariances every pose is exact.
MapSnapshot snapshot_of(const ScanRecord& scan, const std::vector<PoseGraphEdge>& edges,
                        const PoseGraphSolution& solution, PoseCovariances covariances);
/// `placed`, by keyframe id: what is shown of it.
void show(MapSnapshot& map, const std::vector<bool>& placed);
/// The map as a window draws it; poses of the shown component are in the anchor's frame.
MapSnapshot snapshot_of(const SlamMap& map);

/// The patches that are placed, in the frame of the map.
std::vector<PosedSurface> posed_surfaces(const MapSnapshot& map);

}  // namespace gelslam
