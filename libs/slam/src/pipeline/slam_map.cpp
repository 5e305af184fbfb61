#include "gelslam/slam/slam_map.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "gelslam/core/index.hpp"
#include "gelslam/slam/map_snapshot.hpp"

namespace gelslam {

FrameRecord record_of(const TrackedFrame& tracked) {
  FrameRecord record{tracked.frame,
                     tracked.time_s,
                     tracked.status,
                     tracked.trial,
                     tracked.keyframe ? tracked.keyframe->id : -1,
                     tracked.keyframe_T_frame};
  if (tracked.status == TrackStatus::tracked) record.observable = tracked.registration.observable;
  record.unix_us = tracked.unix_us;
  return record;
}

std::optional<std::int64_t> ScanRecord::start_unix_us() const {
  std::int64_t last_us = 0;
  for (const FrameRecord& frame : frames)
    if (frame.unix_us <= std::exchange(last_us, frame.unix_us)) return std::nullopt;
  if (frames.empty()) return std::nullopt;
  return frames.front().unix_us - std::llround(1e6 * frames.front().time_s);
}

std::vector<double> ScanRecord::stamps_s() const {
  const bool on_clock = start_unix_us().has_value();
  std::vector<double> stamps_s;
  for (const FrameRecord& frame : frames)
    stamps_s.push_back(stamp_s(on_clock ? frame.unix_us : 0, frame.time_s));
  return stamps_s;
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
    if (node.placed) patches.push_back({node.keyframe, node.component_T_keyframe, node.surface});
  return patches;
}

MapSnapshot snapshot_of(const ScanRecord& scan, const std::vector<PoseGraphEdge>& edges,
                        const PoseGraphSolution& solution, const std::vector<bool>& placed) {
  MapSnapshot snapshot;
  for (const auto& [id, component] : solution.component_of_node) {
    const Keyframe& keyframe = *scan.keyframes[index(id)];
    snapshot.nodes.push_back({.keyframe = id,
                              .frame = keyframe.frame,
                              .trial = keyframe.trial,
                              .component = component,
                              .component_T_keyframe = solution.component_T_node.at(id),
                              .surface = keyframe.surface,
                              .trial_T_keyframe = keyframe.trial_T_keyframe,
                              .placed = placed[index(id)]});
    if (placed[index(id)]) snapshot.shown_component = component;
  }
  for (std::size_t i = 0; i < solution.edge_outlier.size(); ++i)
    snapshot.edges.push_back({edges[i].from, edges[i].to, edges[i].kind, solution.edge_outlier[i]});
  return snapshot;
}

MapSnapshot snapshot_of(const SlamMap& map) {
  MapSnapshot snapshot = snapshot_of(map, map.solved_edges, map.solution, map.in_map);
  snapshot.gradient_scale = map.gradient_scale;
  for (MapSnapshot::Node& node : snapshot.nodes)
    if (node.component == snapshot.shown_component)
      node.component_T_keyframe = map.anchor_T_keyframe(node.keyframe);
  return snapshot;
}

std::vector<StampedPose> SlamMap::trajectory() const {
  const std::vector<double> stamps = stamps_s();
  std::vector<StampedPose> poses;
  for (std::size_t i = 0; i < frames.size(); ++i)
    if (const FrameRecord& f = frames[i]; has_pose(f))
      poses.push_back({stamps[i], anchor_T_keyframe(f.keyframe) * f.keyframe_T_frame});
  return poses;
}

std::vector<PosedSurface> posed_surfaces(const SlamMap& map) { return posed_surfaces(snapshot_of(map)); }

}  // namespace gelslam
