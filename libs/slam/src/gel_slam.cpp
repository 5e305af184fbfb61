#include "gelslam/slam/gel_slam.hpp"

#include <algorithm>
#include <map>

namespace gelslam {
namespace {

std::map<int, int> tracked_frames_per_group(const std::vector<FrameRecord>& frames, const PoseGraphSolution& solution) {
  std::map<int, int> count;
  for (const FrameRecord& frame : frames)
    if (frame.keyframe >= 0) ++count[solution.group_of_node.at(frame.keyframe)];
  return count;
}

/// Not simply the group's first keyframe: a first touch is faint, and whatever its registration gets wrong would shift
/// and tilt the whole map. The first keyframe that shows at least half of what is usual in this group.
int choose_anchor(const std::vector<std::shared_ptr<const Keyframe>>& keyframes, const std::vector<bool>& in_map) {
  std::vector<int> contact_pixels;
  for (std::size_t id = 0; id < keyframes.size(); ++id)
    if (in_map[id]) contact_pixels.push_back(keyframes[id]->surface->contact_pixels);
  const auto middle = contact_pixels.begin() + static_cast<std::ptrdiff_t>(contact_pixels.size() / 2);
  std::nth_element(contact_pixels.begin(), middle, contact_pixels.end());
  std::size_t id = 0;
  while (!in_map[id] || 2 * keyframes[id]->surface->contact_pixels < *middle) ++id;
  return static_cast<int>(id);
}

int largest_group(const std::map<int, int>& frames_per_group) {
  const auto largest = std::max_element(frames_per_group.begin(), frames_per_group.end(),
                                        [](const auto& a, const auto& b) { return a.second < b.second; });
  return largest->first;
}

}  // namespace

GelSlam::GelSlam(const SlamOptions& options)
    : options_(options), tracker_(options.tracker), loop_closer_(options.loop_closure) {}

TrackedFrame GelSlam::process(std::int64_t frame, double time_s, SurfacePtr surface, StageTimer& timer) {
  TrackedFrame tracked;
  {
    const auto scope = timer.measure("tracking");
    tracked = tracker_.track(frame, time_s, std::move(surface));
  }
  if (tracked.new_keyframe) {
    const auto scope = timer.measure("loop closure");
    add_keyframe(tracked.new_keyframe, tracked.new_keyframe_link);
  }
  frames_.push_back({tracked.frame, tracked.time_s, tracked.status, tracked.trial,
                     tracked.keyframe ? tracked.keyframe->id : -1, tracked.keyframe_T_frame});
  trials_ = std::max(trials_, tracked.trial + 1);
  return tracked;
}

void GelSlam::skip(std::int64_t frame, double time_s) {
  FrameRecord record;
  record.frame = frame;
  record.time_s = time_s;
  record.status = TrackStatus::background;
  frames_.push_back(record);
}

void GelSlam::add_keyframe(const std::shared_ptr<const Keyframe>& keyframe, const KeyframeLink& link) {
  keyframes_.push_back(keyframe);
  if (link.previous) {
    edges_.push_back({link.previous->id, keyframe->id, link.previous_T_this, link.information, EdgeKind::odometry,
                      link.shared_center_mm});
    trial_T_keyframe_[keyframe->id] = trial_T_keyframe_.at(link.previous->id) * link.previous_T_this;
  } else {
    trial_T_keyframe_[keyframe->id] = Pose::Identity();
  }
  for (const LoopConstraint& loop : loop_closer_.add(*keyframe))
    edges_.push_back({loop.from, loop.to, loop.from_T_to, loop.information, EdgeKind::loop, loop.shared_center_mm});
}

SlamMap GelSlam::finish() const {
  SlamMap map;
  map.frames = frames_;
  map.keyframes = keyframes_;
  map.edges = edges_;
  map.trials = trials_;
  if (keyframes_.empty()) return map;

  map.solution = solve_pose_graph(trial_T_keyframe_, map.edges, options_.pose_graph);
  for (int round = 0; options_.refinement.enabled && round < options_.refinement.rounds; ++round) {
    const std::vector<PoseGraphEdge> found = densify(map.keyframes, map.solution, map.edges, options_.refinement);
    if (found.empty()) break;
    map.edges.insert(map.edges.end(), found.begin(), found.end());
    map.solution = solve_pose_graph(map.solution.group_T_node, map.edges, options_.pose_graph);
  }
  map.loops = static_cast<int>(std::count_if(map.edges.begin(), map.edges.end(),
                                             [](const PoseGraphEdge& e) { return e.kind == EdgeKind::loop; }));

  const std::map<int, int> per_group = tracked_frames_per_group(map.frames, map.solution);
  map.groups = static_cast<int>(per_group.size());
  const int group = largest_group(per_group);
  map.in_map.resize(map.keyframes.size());
  for (std::size_t id = 0; id < map.keyframes.size(); ++id)
    map.in_map[id] = map.solution.group_of_node.at(static_cast<int>(id)) == group;
  const int anchor = choose_anchor(map.keyframes, map.in_map);
  map.anchor_frame = map.keyframes[static_cast<std::size_t>(anchor)]->frame;
  map.group_T_anchor = map.solution.group_T_node.at(anchor);
  map.coverage_keyframes = select_coverage_keyframes(posed_surfaces(map), options_.coverage);
  return map;
}

std::vector<PosedSurface> posed_surfaces(const SlamMap& map) {
  std::vector<PosedSurface> patches;
  for (std::size_t id = 0; id < map.keyframes.size(); ++id)
    if (map.in_map[id])
      patches.push_back({static_cast<int>(id), map.anchor_T_keyframe(static_cast<int>(id)), map.keyframes[id]->surface});
  return patches;
}

}  // namespace gelslam
