#include "gelslam/slam/slam_map.hpp"

#include <algorithm>

#include "gelslam/slam/map_snapshot.hpp"

namespace gelslam {

PoseGraphEdge odometry_edge(const KeyframeLink& link, int to) {
  return {link.previous->id,    to, link.previous_T_this, symmetric(link.information), EdgeKind::odometry,
          link.shared_center_mm};
}

FrameRecord record_of(const TrackedFrame& tracked) {
  FrameRecord record{tracked.frame,
                     tracked.time_s,
                     tracked.status,
                     tracked.trial,
                     tracked.keyframe ? tracked.keyframe->id : -1,
                     tracked.keyframe_T_frame};
  if (tracked.status == TrackStatus::tracked) record.observable = tracked.registration.observable;
  return record;
}

FrameRecord background_record(std::int64_t frame, double time_s) {
  FrameRecord record;
  record.frame = frame;
  record.time_s = time_s;
  record.status = TrackStatus::background;
  return record;
}

const MapSnapshot::Node* MapSnapshot::find(int keyframe) const {
  const auto node = std::lower_bound(nodes.begin(), nodes.end(), keyframe,
                                     [](const Node& n, int id) { return n.keyframe < id; });
  return node != nodes.end() && node->keyframe == keyframe ? &*node : nullptr;
}

const MapSnapshot::Node* MapSnapshot::newest_of(int trial) const {
  const auto node =
      std::find_if(nodes.rbegin(), nodes.rend(), [trial](const Node& n) { return n.trial == trial; });
  return node != nodes.rend() ? &*node : nullptr;
}

std::vector<PosedSurface> posed_surfaces(const MapSnapshot& map) {
  std::vector<PosedSurface> patches;
  for (const MapSnapshot::Node& node : map.nodes)
    if (node.component == map.shown_component && node.placed)
      patches.push_back({node.keyframe, node.component_T_keyframe, node.surface});
  return patches;
}

MapSnapshot snapshot_of(const SlamMap& map) {
  MapSnapshot snapshot;
  snapshot.gradient_scale = map.gradient_scale;
  for (const auto& [id, component] : map.solution.component_of_node)
    if (map.in_map[static_cast<std::size_t>(id)]) snapshot.shown_component = component;
  for (const auto& [id, component] : map.solution.component_of_node) {
    const Keyframe& keyframe = *map.keyframes[static_cast<std::size_t>(id)];
    const bool shown = component == snapshot.shown_component;
    snapshot.nodes.push_back({id, keyframe.frame, keyframe.trial, component,
                              shown ? map.anchor_T_keyframe(id) : map.solution.component_T_node.at(id),
                              keyframe.surface, keyframe.trial_T_keyframe});
    snapshot.nodes.back().placed = map.in_map[static_cast<std::size_t>(id)];
  }
  for (std::size_t i = 0; i < map.solved_edges.size(); ++i) {
    const PoseGraphEdge& edge = map.solved_edges[i];
    snapshot.edges.push_back({edge.from, edge.to, edge.kind, map.solution.edge_outlier[i]});
  }
  return snapshot;
}

std::vector<StampedPose> SlamMap::trajectory() const {
  std::vector<StampedPose> poses;
  for (const FrameRecord& f : frames)
    if (has_pose(f)) poses.push_back({f.time_s, anchor_T_keyframe(f.keyframe) * f.keyframe_T_frame});
  return poses;
}

std::vector<PosedSurface> posed_surfaces(const SlamMap& map) {
  std::vector<PosedSurface> patches;
  for (std::size_t id = 0; id < map.keyframes.size(); ++id)
    if (map.in_map[id])
      patches.push_back(
          {static_cast<int>(id), map.anchor_T_keyframe(static_cast<int>(id)), map.keyframes[id]->surface});
  return patches;
}

}  // namespace gelslam
