#pragma once

#include <cstdint>
#include <vector>

#include "gelslam/backend/pose_graph.hpp"
#include "gelslam/surface/stored_surface.hpp"
#include "gelslam/surface/surface.hpp"

namespace gelslam {

/// The poses of all keyframes as estimated now. Immutable; a new one replaces it whenever the pose graph has
/// moved.
struct MapSnapshot {
  struct Node {
    int keyframe = 0;  ///< id; not every id is there
    std::int64_t frame = 0;
    int trial = 0;
    int component = 0;  ///< smallest keyframe id of the component
    Pose component_T_keyframe = Pose::Identity();
    StoredSurface surface{};
    Pose trial_T_keyframe = Pose::Identity();  ///< Keyframe::trial_T_keyframe
    /// Standard deviation of the place in its worst direction, mm, relative to the component's first
    /// keyframe; negative: not known yet, or not in the shown component.
    double sigma_mm = -1;
    bool placed = true;  ///< its place in the shown component is known, so that it is meshed
  };
  struct Edge {
    int from = 0, to = 0;  ///< keyframe ids
    EdgeKind kind = EdgeKind::odometry;
    bool outlier = false;
  };
  std::uint64_t version = 0;
  std::vector<Node> nodes;  ///< by id, ascending
  std::vector<Edge> edges;
  int shown_component = -1;      ///< of the nodes that are placed: it is meshed and drawn; -1: there is none
  GradientScale gradient_scale;  ///< of the surfaces: heights and slopes are to be divided by it

  const Node* find(int keyframe) const;  ///< null when it is not there
  /// The newest of a trial: it places what is tracked until the map has that keyframe. Null without one.
  const Node* newest_of(int trial) const;
};

}  // namespace gelslam
