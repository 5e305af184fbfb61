#include "gelslam/core/ablated.hpp"
#include "gelslam/slam/mapper.hpp"

#include <algorithm>
#include <utility>

#include "gelslam/backend/pose_covariance.hpp"
#include "gelslam/backend/pose_graph.hpp"
#include "gelslam/backend/uncertain_motion.hpp"
#include "gelslam/core/index.hpp"
#include "gelslam/core/median.hpp"
#include "gelslam/core/progress.hpp"
#include "gelslam/slam/refinement.hpp"
#include "pipeline/slope_calibration.hpp"

namespace gelslam {
namespace {

constexpr std::size_t kMaxNeighbors = 256;  // bounds what tracking unpacks and looks through
constexpr int kOverlapRounds = 2;           // the first one's corrections show more overlaps

/// The nearest, in the order in which they were.
std::vector<Neighborhood::Neighbor> nearest(std::vector<Neighborhood::Neighbor> neighbors) {
  if (neighbors.size() <= kMaxNeighbors) return neighbors;
  const auto distance_mm = [](const Neighborhood::Neighbor& neighbor) {
    return neighbor.center_T_keyframe.translation().norm();
  };
  std::vector<double> distances;
  std::transform(neighbors.begin(), neighbors.end(), std::back_inserter(distances), distance_mm);
  std::nth_element(distances.begin(), distances.begin() + kMaxNeighbors - 1, distances.end());
  std::erase_if(neighbors, [&](const auto& n) { return distance_mm(n) > distances[kMaxNeighbors - 1]; });
  neighbors.resize(kMaxNeighbors);
  return neighbors;
}

/// The component with most frames; the oldest of equals.
int largest_component(const std::map<int, int>& frames_per_component) {
  const auto largest = std::max_element(frames_per_component.begin(), frames_per_component.end(),
                                        [](const auto& a, const auto& b) { return a.second < b.second; });
  return largest->first;
}

std::map<int, int> tracked_frames_per_component(const std::vector<FrameRecord>& frames,
                                                const PoseGraphSolution& solution) {
  std::map<int, int> count;
  for (const auto& [id, component] : solution.component_of_node) count[component] = 0;
  for (const FrameRecord& frame : frames)
    if (frame.keyframe >= 0) ++count[solution.component_of_node.at(frame.keyframe)];
  return count;
}

/// The first keyframe that shows at least three quarters of the component's median contact. The first
/// keyframe of all is often a faint touch, and the error of its registration would shift and tilt the whole
/// map.
int choose_anchor(const std::vector<std::shared_ptr<const Keyframe>>& keyframes,
                  const std::vector<bool>& in_map) {
  std::vector<double> contact_pixels;
  for (std::size_t id = 0; id < keyframes.size(); ++id)
    if (in_map[id]) contact_pixels.push_back(keyframes[id]->surface.contact_pixels());
  const double typical_pixels = median(std::move(contact_pixels));
  std::size_t id = 0;
  while (!in_map[id] || (!ablated("anchor") && 4 * keyframes[id]->surface.contact_pixels() < 3 * typical_pixels)) ++id;
  return static_cast<int>(id);
}

/// Those to be kept, in the same order.
std::vector<PoseGraphEdge> chosen(const std::vector<PoseGraphEdge>& edges, const std::vector<bool>& keep) {
  std::vector<PoseGraphEdge> kept;
  for (std::size_t i = 0; i < edges.size(); ++i)
    if (keep[i]) kept.push_back(edges[i]);
  return kept;
}

/// Solves for all poses, and for the gradient scale if asked to.
PoseGraphSolution solve(const std::map<int, Pose>& initial, const std::vector<PoseGraphEdge>& edges,
                        double scale_sigma, const SlamOptions& options) {
  if (initial.empty()) return {};  // a scan that has touched nothing has no model's sigma, either
  return options.slope_calibration.estimate_gradient_scale
             ? solve_with_gradient_scale(initial, edges, options.pose_graph, scale_sigma)
             : solve_pose_graph(initial, edges, options.pose_graph);
}

/// From the unknowns of solve().
SlopeCorrection gradient_scale_in(const PoseGraphSolution& solution) {
  SlopeCorrection correction;
  for (int term = 0; term < solution.shared_unknowns.size(); ++term)
    correction.factors[SlopeCorrection::kLinear[index(term)]] = solution.shared_unknowns[term];
  return correction;
}

void add_overlap_edges(SlamMap& map, double scale_sigma, const SlamOptions& options,
                       const std::function<bool()>& stop_requested, ParallelProgress& progress) {
  for (int round = 0; round < kOverlapRounds; ++round) {
    const std::vector<PoseGraphEdge> found =
        find_overlap_edges(map.keyframes, map.solution, map.edges, options, stop_requested, &progress);
    if (found.empty() || stop_requested()) return;
    map.edges.insert(map.edges.end(), found.begin(), found.end());
    map.edges = chosen(map.edges, consistent_edges(map.edges, scale_sigma));
    map.solution = solve(map.solution.component_T_node, map.edges, scale_sigma, options);
  }
}

/// `tracked`: links as the tracker measured them.
void calibrate(SlamMap& map, const std::vector<PoseGraphEdge>& tracked, const SlamOptions& options,
               const std::function<bool()>& stop_requested, ProgressSink* progress) {
  std::optional<slam::detail::CalibratedMap> calibrated =
      slam::detail::calibrate_slopes(map, options.pose_graph, options.slope_calibration, options.registration,
                                     stop_requested, progress, options.fusion.threads);
  if (!calibrated) return;
  map.keyframes = std::move(calibrated->keyframes);
  map.edges = std::move(calibrated->edges);
  map.solution = std::move(calibrated->solution);
  map.slope_correction = calibrated->correction;
  map.surfaces_corrected = true;
  slam::detail::distribute_corrections(tracked, map.edges, map.frames);
}

}  // namespace

PoseGraphEdge loop_edge(const LoopConstraint& loop) {
  return {loop.from,      loop.to,
          loop.from_T_to, symmetric(loop.information),
          EdgeKind::loop, loop.shared_center_mm,
          loop.tentative};
}

Mapper::Mapper(const SlamOptions& options)
    : options_(options), loop_closer_(options.loop_closure, options.registration, options.verification) {}

std::vector<PoseGraphEdge> Mapper::add_keyframe(const NewKeyframe& added, bool search_loops) {
  const auto& [keyframe, link] = added;
  const int id = keyframe->id;
  keyframes_.resize(static_cast<std::size_t>(id) + 1);
  keyframes_.back() = keyframe;
  trial_T_keyframe_[id] = live_.component_T_node[id] = Pose::Identity();
  if (link.previous) {
    add_edge(odometry_edge(link, id));
    trial_T_keyframe_[id] = trial_T_keyframe_.at(link.previous->id) * link.previous_T_this;
    live_.component_T_node[id] = live_.component_T_node.at(link.previous->id) * link.previous_T_this;
  }
  searched_.resize(keyframes_.size());
  searched_.back() = search_loops;
  if (!search_loops) return {};
  std::vector<PoseGraphEdge> loops = this->search_loops(*keyframe, link.previous ? link.previous->id : -1);
  for (const PoseGraphEdge& loop : loops) add_edge(loop);
  return loops;
}

std::vector<PoseGraphEdge> Mapper::search_loops(const Keyframe& keyframe, int previous) {
  loop_closer_.keep(std::exchange(restored_, {}));
  std::vector<PoseGraphEdge> loops;
  for (const LoopConstraint& loop : loop_closer_.add(keyframe))
    if (loop.from != previous)  // the link already holds this registration
      loops.push_back(loop_edge(loop));
  new_loops_ += static_cast<int>(loops.size());
  return loops;
}

std::map<int, std::vector<PoseGraphEdge>> Mapper::restore(const ScanRecord& record) {
  parts_ = record.parts;
  keyframes_ = record.keyframes;
  searched_ = record.searched;
  std::vector<PoseGraphEdge> edges = record.edges;
  new_loops_ = static_cast<int>(edges.size());
  std::map<int, const PoseGraphEdge*> links;
  for (const PoseGraphEdge& edge : record.edges)
    if (edge.kind == EdgeKind::odometry) links[edge.to] = &edge;
  for (const auto& keyframe : keyframes_) {
    if (!keyframe) continue;
    const auto link = links.find(keyframe->id);
    const Pose trial_T_keyframe =
        link == links.end() ? Pose::Identity()
                            : Pose(trial_T_keyframe_.at(link->second->from) * link->second->from_T_to);
    trial_T_keyframe_[keyframe->id] = live_.component_T_node[keyframe->id] = trial_T_keyframe;
    if (searched_[index(keyframe->id)]) restored_.push_back(*keyframe);
  }
  const int newest_searched = restored_.empty() ? -1 : restored_.back().id;
  std::map<int, std::vector<PoseGraphEdge>> found;
  for (const auto& keyframe : keyframes_) {
    if (!keyframe || searched_[index(keyframe->id)]) continue;
    if (keyframe->id < newest_searched) continue;  // damaged record: it stays without
    const auto link = links.find(keyframe->id);
    found[keyframe->id] = search_loops(*keyframe, link == links.end() ? -1 : link->second->from);
    edges.insert(edges.end(), found[keyframe->id].begin(), found[keyframe->id].end());
    searched_[index(keyframe->id)] = true;
  }
  // As if all had been found in one go.
  std::stable_sort(edges.begin(), edges.end(), [](const auto& a, const auto& b) { return a.to < b.to; });
  for (const PoseGraphEdge& edge : edges) add_edge(edge);
  return found;
}

void Mapper::add_edge(const PoseGraphEdge& edge) {
  edges_of_[edge.from].push_back(edges_.size());
  edges_of_[edge.to].push_back(edges_.size());
  edges_.push_back(edge);
}

/// Which of edges_ are consistent.
const std::vector<bool>& Mapper::judge_edges() {
  return consistency_.judge(edges_,
                            slam::detail::gradient_scale_sigma(keyframes_, options_.slope_calibration));
}

Neighborhood Mapper::neighborhood(int keyframe) {
  const std::vector<bool>& consistent = judge_edges();
  // Half of the sensor: what is further away does not show most of what a frame near this keyframe shows.
  constexpr double kReachMm = 10.0;
  Neighborhood result{keyframe, {}};
  std::map<int, Pose> center_T_node{{keyframe, Pose::Identity()}};
  std::vector<int> reached{keyframe};
  for (std::size_t next = 0; next < reached.size(); ++next) {
    const auto of_node = edges_of_.find(reached[next]);
    if (of_node == edges_of_.end()) continue;
    const Pose center_T_this = center_T_node.at(reached[next]);
    for (const std::size_t i : of_node->second) {
      const PoseGraphEdge& edge = edges_[i];
      const bool forward = edge.from == reached[next];
      const int other = forward ? edge.to : edge.from;
      if (edge.tentative || !consistent[i] || center_T_node.contains(other)) continue;
      const Pose center_T_other = center_T_this * (forward ? edge.from_T_to : Pose(edge.from_T_to.inverse()));
      if (center_T_other.translation().norm() > kReachMm || center_T_other.linear()(2, 2) <= 0) continue;
      center_T_node.emplace(other, center_T_other);
      reached.push_back(other);
      result.others.push_back({keyframes_[static_cast<std::size_t>(other)], center_T_other});
    }
  }
  result.others = nearest(std::move(result.others));
  return result;
}

void Mapper::forget_from_trial(int trial) {
  const auto first = std::find_if(keyframes_.begin(), keyframes_.end(),
                                  [&](const auto& keyframe) { return keyframe && keyframe->trial >= trial; });
  if (first == keyframes_.end()) return;
  const int id = (*first)->id;
  keyframes_.erase(first, keyframes_.end());
  searched_.resize(keyframes_.size());
  loop_closer_.keep(std::exchange(restored_, {}));
  loop_closer_.forget_from(id);
  trial_T_keyframe_.erase(trial_T_keyframe_.lower_bound(id), trial_T_keyframe_.end());
  live_.component_T_node.erase(live_.component_T_node.lower_bound(id), live_.component_T_node.end());
  std::vector<PoseGraphEdge> kept;
  std::swap(kept, edges_);
  edges_of_.clear();
  consistency_.forget();
  for (const PoseGraphEdge& edge : kept)
    if (edge.from < id && edge.to < id) add_edge(edge);
  update();
}

void Mapper::update() {
  PoseGraphOptions options = options_.pose_graph;
  options.only_where_needed = true;
  live_edges_ = chosen(edges_, judge_edges());
  const Eigen::VectorXd scale = live_.shared_unknowns;  // held until optimize()
  live_ = solve_pose_graph(live_.component_T_node, scale_corrected(live_edges_, scale), options);
  live_.shared_unknowns = scale;
  ++version_;
}

void Mapper::optimize() {
  const double scale_sigma = slam::detail::gradient_scale_sigma(keyframes_, options_.slope_calibration);
  live_edges_ = chosen(edges_, judge_edges());
  live_ = solve(live_.component_T_node, live_edges_, scale_sigma, options_);
  new_loops_ = 0;
  ++version_;
}

MapSnapshot Mapper::snapshot() const {
  MapSnapshot snapshot;
  snapshot.version = version_;
  snapshot.gradient_scale = gradient_scale_in(live_).scale();
  std::map<int, int> keyframes_per_component;
  for (const auto& [id, component] : live_.component_of_node) {
    const Keyframe& keyframe = *keyframes_[static_cast<std::size_t>(id)];
    snapshot.nodes.push_back(
        {id, keyframe.frame, keyframe.trial, component, live_.component_T_node.at(id), keyframe.surface});
    ++keyframes_per_component[component];
  }
  for (std::size_t i = 0; i < live_.edge_outlier.size(); ++i)
    snapshot.edges.push_back(
        {live_edges_[i].from, live_edges_[i].to, live_edges_[i].kind, live_.edge_outlier[i]});
  if (!keyframes_per_component.empty()) snapshot.shown_component = largest_component(keyframes_per_component);
  return snapshot;
}

SlamMap Mapper::finish(const std::vector<FrameRecord>& frames, bool refine,
                       const std::function<bool()>& stop_requested, ProgressSink* progress) const {
  ParallelProgress closing(progress, "closing loops", kOverlapRounds * keyframes_.size());
  SlamMap map;
  map.measured = {parts_, keyframes_, edges_, searched_, frames, {}};
  map.frames = frames;
  for (FrameRecord& frame : map.frames)
    if (!trial_T_keyframe_.contains(frame.keyframe))
      frame.keyframe = -1;  // its keyframe has not reached the mapper yet
  map.keyframes = keyframes_;
  std::vector<PoseGraphEdge> edges = edges_;
  for (const LoopConstraint& loop : ablated("rejoin") ? std::vector<LoopConstraint>{} : rejoin_broken_trials(keyframes_, map.frames, parts_, options_)) {
    const bool known = std::any_of(edges_.begin(), edges_.end(), [&](const PoseGraphEdge& edge) {
      return edge.from == loop.from && edge.to == loop.to;
    });
    if (!known) edges.push_back(loop_edge(loop));
  }
  const double scale_sigma = slam::detail::gradient_scale_sigma(keyframes_, options_.slope_calibration);
  map.edges = chosen(edges, consistent_edges(edges, scale_sigma));
  for (const FrameRecord& frame : frames) map.trials = std::max(map.trials, frame.trial + 1);
  map.in_map.resize(map.keyframes.size());
  if (trial_T_keyframe_.empty()) {
    closing.end();
    return map;
  }

  map.solution = solve(trial_T_keyframe_, map.edges, scale_sigma, options_);
  if (refine && options_.refinement.enabled)
    add_overlap_edges(map, scale_sigma, options_, stop_requested, closing);
  closing.end();
  map.slope_correction = gradient_scale_in(map.solution);
  if (refine && options_.slope_calibration.enabled && !stop_requested())
    calibrate(map, edges_, options_, stop_requested, progress);
  map.loops = static_cast<int>(std::count_if(
      map.edges.begin(), map.edges.end(), [](const PoseGraphEdge& e) { return e.kind == EdgeKind::loop; }));

  const std::map<int, int> per_component = tracked_frames_per_component(map.frames, map.solution);
  map.components = static_cast<int>(per_component.size());
  const int component = largest_component(per_component);
  for (const auto& [id, component_of_id] : map.solution.component_of_node)
    map.in_map[static_cast<std::size_t>(id)] = component_of_id == component;
  const int anchor = choose_anchor(map.keyframes, map.in_map);
  map.anchor_frame = map.keyframes[static_cast<std::size_t>(anchor)]->frame;
  map.component_T_anchor = map.solution.component_T_node.at(anchor);
  const bool scale_is_unknown = options_.slope_calibration.estimate_gradient_scale;
  map.uncertainty =
      trajectory_uncertainty(map.frames, map.in_map,
                             pose_covariances(map.edges, map.solution, anchor, options_.pose_graph,
                                              scale_is_unknown ? scale_sigma : 0.0));
  map.coverage_keyframes = select_coverage_keyframes(posed_surfaces(map), options_.coverage);
  return map;
}

}  // namespace gelslam
