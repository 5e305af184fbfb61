// From keyframes to a map: loops, choice of the loops that are consistent, pose graph, overlap edges, and the
// choice of the keyframes that form the map (Huang et al., GelSLAM, T-RO 2026; docs/algorithms.md).
//
// While a scan goes on, optimize() solves the pose graph with the loops found so far. At the end,
// solve_scan() solves it again from the measurements alone, registers overlapping keyframes and solves once
// more. The map is the group of keyframes whose relative poses are determined and that has most tracked
// frames. Its frame is that of an anchor keyframe with a typical contact area.

#include "gelslam/slam/mapper.hpp"

#include <algorithm>
#include <optional>
#include <set>
#include <utility>

#include "gelslam/backend/pose_covariance.hpp"
#include "gelslam/backend/uncertain_motion.hpp"
#include "gelslam/core/index.hpp"
#include "gelslam/core/median.hpp"
#include "gelslam/slam/refinement.hpp"
#include "gelslam/slam/trajectory_uncertainty.hpp"

namespace gelslam {

namespace {

/// Returns the number of tracked frames for each keyframe id.
std::vector<int> tracked_frames(const std::vector<FrameRecord>& frames, std::size_t keyframes) {
  std::vector<int> count(keyframes, 0);
  for (const FrameRecord& frame : frames)
    if (frame.keyframe >= 0) ++count[index(frame.keyframe)];
  return count;
}

/// Returns the smallest keyframe id of a part after the first one with contact. Later parts extend the map of
/// the first one and, however long, do not replace it.
int first_continuing(const ScanRecord& scan) {
  std::optional<std::size_t> first;
  for (const auto& keyframe : scan.keyframes) {
    if (!keyframe) continue;
    const std::size_t part = part_of_frame(scan.parts, keyframe->frame);
    if (part != first.value_or(part)) return keyframe->id;
    first = part;
  }
  return scan.last_keyframe() + 1;
}

/// Determines which keyframes form the map: a group connected by edges that are no outliers and that
/// constrain the relative pose (constrains_pose()). Among several groups it is the one with most `frames`
/// before keyframe `continuing`; among equal ones the oldest. Returns a flag per keyframe id.
std::vector<bool> placed_keyframes(const MapSnapshot& map, const std::vector<int>& frames, int continuing) {
  UnionFind groups(static_cast<int>(frames.size()));
  const auto join = [&](bool continues) {
    for (const MapSnapshot::Edge& edge : map.edges)
      if ((std::max(edge.from, edge.to) >= continuing) == continues && !edge.outlier && edge.constrains &&
          groups.root(edge.from) != groups.root(edge.to))
        groups.join(edge.from, edge.to);
  };
  join(false);
  std::map<int, int> per_group;
  for (const auto& node : map.nodes)
    if (node.keyframe < continuing) per_group[groups.root(node.keyframe)] += frames[index(node.keyframe)];
  join(true);
  std::vector<bool> placed(frames.size(), false);
  if (per_group.empty()) return placed;
  const auto largest = std::max_element(per_group.begin(), per_group.end(),
                                        [](const auto& a, const auto& b) { return a.second < b.second; });
  for (const auto& node : map.nodes)
    placed[index(node.keyframe)] = groups.root(node.keyframe) == groups.root(largest->first);
  return placed;
}

/// Returns the anchor: the first keyframe of the map before `continuing` whose contact has at least three
/// quarters of their median area. The very first keyframe often shows a faint touch, and the error of its
/// registration would shift and tilt the whole map.
int choose_anchor(const std::vector<std::shared_ptr<const Keyframe>>& keyframes,
                  const std::vector<bool>& in_map, int continuing) {
  std::vector<double> contact_pixels;
  for (std::size_t id = 0; id < index(continuing); ++id)
    if (in_map[id]) contact_pixels.push_back(keyframes[id]->surface.facts().contact_pixels);
  const double typical_pixels = median(std::move(contact_pixels));
  std::size_t id = 0;
  while (!in_map[id] || 4 * keyframes[id]->surface.facts().contact_pixels < 3 * typical_pixels) ++id;
  return static_cast<int>(id);
}

/// Returns the edges with a set flag, in the same order.
std::vector<PoseGraphEdge> chosen(const std::vector<PoseGraphEdge>& edges, const std::vector<bool>& keep) {
  std::vector<PoseGraphEdge> kept;
  for (std::size_t i = 0; i < edges.size(); ++i)
    if (keep[i]) kept.push_back(edges[i]);
  return kept;
}

/// Returns initial poses for solving the pose graph. Each keyframe is placed along the path with the fewest
/// edges from the first keyframe of its component. Along a path of odometry alone, drift could bend the map
/// too far for the loops to correct.
std::map<int, Pose> spread(const ScanRecord& scan, const std::vector<PoseGraphEdge>& edges) {
  const auto motion = motions_between(edges, std::vector<bool>(edges.size(), false), 0);
  UnionFind components(static_cast<int>(scan.keyframes.size()));
  for (const PoseGraphEdge& edge : edges) components.join(edge.from, edge.to);
  std::map<int, Pose> poses;
  for (const auto& keyframe : scan.keyframes) {
    if (!keyframe) continue;
    const int id = keyframe->id, first = components.root(id);
    poses[id] = first == id ? Pose(Pose::Identity()) : motion(first, id)->pose;
  }
  return poses;
}

/// Solves the pose graph, and for the gradient scale if the options ask for it.
PoseGraphSolution solve_poses(const std::map<int, Pose>& initial, const std::vector<PoseGraphEdge>& edges,
                              double scale_sigma, const SlamOptions& options) {
  // Without any keyframe there is no model either from which to take its sigma.
  if (initial.empty()) return {};
  return options.gradient_scale.estimate
             ? solve_with_gradient_scale(initial, edges, options.pose_graph, scale_sigma)
             : solve_pose_graph(initial, edges, options.pose_graph);
}

/// Removes loops that are not consistent with the other edges, and solves the pose graph.
void solve_map(SlamMap& map, double scale_sigma, const SlamOptions& options) {
  map.solved_edges = chosen(map.solved_edges, consistent_edges(map.solved_edges, scale_sigma));
  const std::map<int, Pose>& known = map.solution.component_T_node;
  map.solution = solve_poses(known.empty() ? spread(map, map.solved_edges) : known, map.solved_edges,
                             scale_sigma, options);
}

/// Registers keyframes that should overlap, and solves the pose graph again with the edges found.
void add_overlap_edges(SlamMap& map, double scale_sigma, const SlamOptions& options,
                       const std::function<bool()>& stop_requested, ParallelProgress& progress) {
  const std::vector<PoseGraphEdge> found =
      find_overlap_edges(map.keyframes, map.solution, map.solved_edges, options, stop_requested, &progress);
  if (found.empty()) return;
  map.solved_edges.insert(map.solved_edges.end(), found.begin(), found.end());
  solve_map(map, scale_sigma, options);
}

PoseCovariances covariances(const std::vector<PoseGraphEdge>& edges, const PoseGraphSolution& solution,
                            int anchor, double scale_sigma, const SlamOptions& options) {
  return pose_covariances(edges, solution, anchor, options.pose_graph,
                          options.gradient_scale.estimate ? scale_sigma : 0.0);
}

/// Returns a map with the measurements only, before the pose graph is solved.
SlamMap unsolved(ScanRecord scan) {
  SlamMap map;
  static_cast<ScanRecord&>(map) = std::move(scan);
  map.solved_edges = map.edges;
  map.in_map.resize(map.keyframes.size());
  for (FrameRecord& frame : map.frames) {
    // The keyframe has not reached the mapper yet.
    if (!map.has_keyframe(frame.keyframe)) frame.keyframe = -1;
    map.trials = std::max(map.trials, frame.trial + 1);
  }
  return map;
}

/// Determines which keyframes form the map, and its anchor, whose frame the map has. Returns the anchor's id.
int choose_map_and_anchor(SlamMap& map) {
  map.loops =
      static_cast<int>(std::count_if(map.solved_edges.begin(), map.solved_edges.end(),
                                     [](const PoseGraphEdge& e) { return e.kind == EdgeKind::loop; }));
  std::set<int> components;
  for (const auto& [id, component] : map.solution.component_of_node) components.insert(component);
  map.components = static_cast<int>(components.size());
  const int continuing = first_continuing(map);
  map.in_map = placed_keyframes(snapshot_of(map, map.solved_edges, map.solution, {}),
                                tracked_frames(map.frames, map.keyframes.size()), continuing);
  const int anchor = choose_anchor(map.keyframes, map.in_map, continuing);
  map.anchor_frame = map.keyframes[index(anchor)]->frame;
  map.component_T_anchor = map.solution.component_T_node.at(anchor);
  return anchor;
}

}  // namespace

Mapper::Mapper(const SlamOptions& options)
    : options_(options), loop_closer_(options.loop_closure, options.registration, options.verification) {}

std::vector<PoseGraphEdge> Mapper::add_keyframe(const NewKeyframe& added, bool search_loops) {
  const auto& keyframe = added.keyframe;
  const int id = keyframe->id;
  measured_.keyframes.resize(static_cast<std::size_t>(id) + 1);
  measured_.keyframes.back() = keyframe;
  if (added.edge) measured_.edges.push_back(*added.edge);
  live_.add(added, options_.gradient_scale);
  measured_.searched.resize(measured_.keyframes.size());
  if (!search_loops || keyframe->is_patch) return {};
  measured_.searched.back() = true;
  std::vector<PoseGraphEdge> loops = this->search_loops(*keyframe);
  measured_.edges.insert(measured_.edges.end(), loops.begin(), loops.end());
  return loops;
}

std::vector<PoseGraphEdge> Mapper::search_loops(const Keyframe& keyframe) {
  remember_places();
  std::vector<PoseGraphEdge> loops = loop_closer_.add(keyframe);
  new_loops_ += static_cast<int>(loops.size());
  return loops;
}

std::map<int, std::vector<PoseGraphEdge>> Mapper::restore(const ScanRecord& record) {
  measured_ = {record.parts, record.keyframes, record.edges, record.searched};
  new_loops_ = static_cast<int>(record.edges.size());
  for (const auto& keyframe : record.keyframes)
    if (keyframe && record.searched[index(keyframe->id)]) restored_.push_back(*keyframe);
  const int newest_searched = restored_.empty() ? -1 : restored_.back().id;
  std::map<int, std::vector<PoseGraphEdge>> found;
  for (const auto& keyframe : record.keyframes) {
    if (!keyframe || keyframe->is_patch || record.searched[index(keyframe->id)]) continue;
    // Only a damaged record has such a keyframe; it stays without loops.
    if (keyframe->id < newest_searched) continue;
    const auto& loops = found[keyframe->id] = search_loops(*keyframe);
    measured_.edges.insert(measured_.edges.end(), loops.begin(), loops.end());
    measured_.searched[index(keyframe->id)] = true;
  }
  // The order is the same as if all loops had been found in one scan.
  std::stable_sort(measured_.edges.begin(), measured_.edges.end(),
                   [](const auto& a, const auto& b) { return a.to < b.to; });
  return found;
}

void Mapper::optimize() {
  const double scale_sigma = gradient_scale_sigma(measured_.keyframes, options_.gradient_scale);
  const auto edges = chosen(measured_.edges, consistent_edges(measured_.edges, scale_sigma));
  const PoseGraphSolution solution = solve_poses(spread(measured_, edges), edges, scale_sigma, options_);
  const std::uint64_t version = live_.version + 1;
  live_ = snapshot_of(measured_, edges, solution, covariances(edges, solution, -1, scale_sigma, options_));
  live_.version = version;
  new_loops_ = 0;
}

MapSnapshot Mapper::snapshot() const {
  MapSnapshot snapshot = live_;
  show(snapshot,
       placed_keyframes(live_, std::vector<int>(measured_.keyframes.size(), 1), first_continuing(measured_)));
  return snapshot;
}

ScanRecord Mapper::measured(const std::vector<FrameRecord>& frames) const {
  ScanRecord scan = measured_;
  scan.frames = frames;
  return scan;
}

SlamMap solve_scan(ScanRecord scan, const SlamOptions& options, bool refine,
                   const std::function<bool()>& stop_requested, ProgressSink* progress) {
  ParallelProgress closing(progress, "closing loops", scan.keyframes.size());
  SlamMap map = unsolved(std::move(scan));
  const double scale_sigma = gradient_scale_sigma(map.keyframes, options.gradient_scale);
  solve_map(map, scale_sigma, options);
  if (map.solution.component_T_node.empty()) {
    closing.end();
    return map;
  }
  if (refine && options.refinement.max_pairs_per_keyframe > 0)
    add_overlap_edges(map, scale_sigma, options, stop_requested, closing);
  closing.end();
  const int anchor = choose_map_and_anchor(map);
  map.covariances = covariances(map.solved_edges, map.solution, anchor, scale_sigma, options);
  map.uncertainty = trajectory_uncertainty(map.frames, snapshot_of(map));
  return map;
}

}  // namespace gelslam
