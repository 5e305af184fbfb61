#include "gelslam/slam/slam_map.hpp"

#include <algorithm>

#include "gelslam/slam/map_snapshot.hpp"

namespace gelslam {

FrameRecord record_of(const TrackedFrame& tracked) {
  return {tracked.frame, tracked.time_s, tracked.status, tracked.trial, tracked.keyframe ? tracked.keyframe->id : -1,
          tracked.keyframe_T_frame};
}

FrameRecord background_record(std::int64_t frame, double time_s) {
  FrameRecord record;
  record.frame = frame;
  record.time_s = time_s;
  record.status = TrackStatus::background;
  return record;
}

const MapSnapshot::Node* MapSnapshot::find(int keyframe) const {
  const auto node =
      std::lower_bound(nodes.begin(), nodes.end(), keyframe, [](const Node& n, int id) { return n.keyframe < id; });
  return node != nodes.end() && node->keyframe == keyframe ? &*node : nullptr;
}

std::vector<PosedSurface> posed_surfaces(const SlamMap& map) {
  std::vector<PosedSurface> patches;
  for (std::size_t id = 0; id < map.keyframes.size(); ++id)
    if (map.in_map[id])
      patches.push_back({static_cast<int>(id), map.anchor_T_keyframe(static_cast<int>(id)), map.keyframes[id]->surface});
  return patches;
}

}  // namespace gelslam
