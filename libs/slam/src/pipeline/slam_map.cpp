#include "gelslam/slam/slam_map.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "gelslam/core/index.hpp"
#include "gelslam/slam/map_snapshot.hpp"

namespace gelslam {
namespace {

MapSnapshot::Edge shown_edge(const PoseGraphEdge& edge, bool outlier) {
  return {edge.from, edge.to, edge.kind, outlier, constrains_pose(edge)};
}

}  // namespace

FrameRecord record_of(const TrackedFrame& tracked) {
  FrameRecord record{tracked.frame,
                     tracked.time_s,
                     tracked.status,
                     tracked.trial,
                     tracked.keyframe ? tracked.keyframe->id : -1,
                     tracked.keyframe_T_frame};
  record.unix_us = tracked.unix_us;
  if (tracked.status != TrackStatus::tracked) return record;
  record.observable = tracked.registration.observable;
  if (tracked.keyframe->frame == tracked.frame) return record;
  const PoseGraphEdge edge = odometry_edge(record.keyframe, -1, tracked.registration);
  record.covariance = symmetric(uncertain_motion(edge).from_T_to.covariance);
  record.shared_center_mm = edge.shared_center_mm;
  return record;
}

UncertainMotion FrameRecord::keyframe_T_frame_measured() const {
  return {{keyframe_T_frame, covariance},
          motion_by_gradient_scale({.from_T_to = keyframe_T_frame, .shared_center_mm = shared_center_mm})};
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

GradientScale gradient_scale_of(const Eigen::VectorXd& factors) {
  if (factors.size() == 0) return {};
  return {1.0 / (1.0 - factors[0]), 1.0 / (1.0 - factors[3])};
}

std::optional<MapSnapshot::Located> MapSnapshot::locate(int keyframe, const UncertainMotion& keyframe_T_frame,
                                                        std::span<const NewKeyframe> newer) const {
  UncertainMotion map_T_frame = keyframe_T_frame.corrected(scale_factors);
  for (auto added = newer.rbegin();; ++added) {
    if (const Node* node = find(keyframe))
      return Located{compose({{node->component_T_keyframe, node->covariance}, node->by_scale}, map_T_frame),
                     node->component};
    while (added != newer.rend() && added->keyframe->id != keyframe) ++added;
    if (added == newer.rend()) return std::nullopt;
    if (!added->edge) return Located{map_T_frame, keyframe};
    map_T_frame = compose(uncertain_motion(*added->edge).corrected(scale_factors), map_T_frame);
    keyframe = added->edge->from;
  }
}

void MapSnapshot::add(const NewKeyframe& added, const GradientScaleOptions& options) {
  const Keyframe& keyframe = *added.keyframe;
  if (nodes.empty() && options.estimate)
    scale_covariance = prior_scale_covariance(options.sigma * keyframe.surface.facts().slope_sigma_ratio);
  const auto [motion, component] = locate(keyframe.id, {}, {&added, 1}).value();
  nodes.push_back({.keyframe = keyframe.id,
                   .frame = keyframe.frame,
                   .trial = keyframe.trial,
                   .component = component,
                   .component_T_keyframe = normalized(motion.from_T_to.pose),
                   .surface = keyframe.surface,
                   .covariance = motion.from_T_to.covariance,
                   .by_scale = motion.by_scale});
  if (added.edge) edges.push_back(shown_edge(*added.edge, false));
  ++version;
}

namespace {

/// Adds to the covariance what large rotations do to the translation. An error (w, p) displaces the frame by
/// V(w) p, which to second order is p + w x p / 2. For example, if a ball rolls and its rotation is not
/// observable, the height of the sensor is wrong, too, although to first order it was measured. The fourth
/// moments are those of a normal distribution.
Matrix6d with_second_order(Matrix6d covariance) {
  const Matrix6d first = covariance;
  const auto moment = [&first](int a, int b, int c, int d) {
    return first(a, b) * first(c, d) + first(a, c) * first(b, d) + first(a, d) * first(b, c);
  };
  for (int axis = 0; axis < 3; ++axis) {
    const int w1 = (axis + 1) % 3, w2 = (axis + 2) % 3, p1 = 3 + w1, p2 = 3 + w2;
    covariance(3 + axis, 3 + axis) +=
        0.25 * (moment(w1, w1, p2, p2) + moment(w2, w2, p1, p1) - 2 * moment(w1, w2, p1, p2));
  }
  return covariance;
}

}  // namespace

std::optional<MapPlace> MapSnapshot::pose_of(const FrameRecord& frame,
                                             std::span<const NewKeyframe> newer) const {
  const auto located = locate(frame.keyframe, frame.keyframe_T_frame_measured(), newer);
  if (!located) return std::nullopt;
  const auto& [place, component] = *located;
  return MapPlace{
      {normalized(place.from_T_to.pose), with_second_order(place.total_covariance(scale_covariance))},
      component};
}

std::optional<MapPlace> TrialMap::add(const TrackedFrame& frame) {
  for (const NewKeyframe& added : frame.new_keyframes) {
    if (!added.edge) map_ = {};
    map_.add(added, options_);
    map_.nodes.back().surface = {};  // The surface of a node of this map is not used.
  }
  if (frame.status != TrackStatus::tracked) return std::nullopt;
  return map_.pose_of(record_of(frame));
}

std::vector<PosedSurface> posed_surfaces(const MapSnapshot& map) {
  std::vector<PosedSurface> patches;
  for (const MapSnapshot::Node& node : map.nodes)
    if (node.placed) patches.push_back({node.keyframe, node.component_T_keyframe, node.surface});
  return patches;
}

MapSnapshot snapshot_of(const ScanRecord& scan, const std::vector<PoseGraphEdge>& edges,
                        const PoseGraphSolution& solution, PoseCovariances covariances) {
  MapSnapshot snapshot;
  for (const auto& [id, component] : solution.component_of_node) {
    const Keyframe& keyframe = *scan.keyframes[index(id)];
    const UncertainMotion& motion = covariances.component_T_node[id];
    snapshot.nodes.push_back({.keyframe = id,
                              .frame = keyframe.frame,
                              .trial = keyframe.trial,
                              .component = component,
                              .component_T_keyframe = solution.component_T_node.at(id),
                              .surface = keyframe.surface,
                              .placed = false,
                              .covariance = motion.from_T_to.covariance,
                              .by_scale = motion.by_scale});
  }
  for (std::size_t i = 0; i < solution.edge_outlier.size(); ++i)
    snapshot.edges.push_back(shown_edge(edges[i], solution.edge_outlier[i]));
  snapshot.gradient_scale = gradient_scale_of(solution.shared_unknowns);
  snapshot.scale_factors = solution.shared_unknowns;
  snapshot.scale_covariance = covariances.scale;
  return snapshot;
}

void show(MapSnapshot& map, const std::vector<bool>& placed) {
  map.shown_component = -1;
  for (MapSnapshot::Node& node : map.nodes) {
    node.placed = placed[index(node.keyframe)];
    if (node.placed) map.shown_component = node.component;
  }
}

MapSnapshot snapshot_of(const SlamMap& map) {
  MapSnapshot snapshot = snapshot_of(map, map.solved_edges, map.solution, map.covariances);
  show(snapshot, map.in_map);
  for (MapSnapshot::Node& node : snapshot.nodes)
    if (node.component == snapshot.shown_component)
      node.component_T_keyframe = map.anchor_T_keyframe(node.keyframe);
  return snapshot;
}

std::vector<StampedPose> SlamMap::trajectory() const {
  const MapSnapshot map = snapshot_of(*this);
  const std::vector<double> stamps = stamps_s();
  std::vector<StampedPose> poses;
  for (std::size_t i = 0; i < frames.size(); ++i)
    if (has_pose(frames[i])) {
      const UncertainPose place = map.pose_of(frames[i])->map_T_frame;
      poses.push_back({stamps[i], place.pose, place.covariance});
    }
  return poses;
}

}  // namespace gelslam
