#include "gelslam/slam/slam_map.hpp"

#include <algorithm>
#include <fstream>
#include <nlohmann/json.hpp>

#include "gelslam/core/text.hpp"
#include "gelslam/slam/map_snapshot.hpp"

namespace gelslam {

Matrix6d symmetric(const Matrix6d& information) { return 0.5 * (information + information.transpose()); }

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

std::vector<PosedSurface> posed_surfaces(const MapSnapshot& map) {
  std::vector<PosedSurface> patches;
  for (const MapSnapshot::Node& node : map.nodes)
    if (node.component == map.shown_component)
      patches.push_back({node.keyframe, node.component_T_keyframe, node.surface});
  return patches;
}

MapSnapshot snapshot_of(const SlamMap& map) {
  MapSnapshot snapshot;
  snapshot.gradient_scale = map.slope_correction.scale();
  for (const auto& [id, component] : map.solution.component_of_node) {
    const Keyframe& keyframe = *map.keyframes[static_cast<std::size_t>(id)];
    const bool shown = map.in_map[static_cast<std::size_t>(id)];
    if (shown) snapshot.shown_component = component;
    snapshot.nodes.push_back({id, keyframe.frame, keyframe.trial, component,
                              shown ? map.anchor_T_keyframe(id) : map.solution.component_T_node.at(id),
                              keyframe.surface, keyframe.trial_T_keyframe});
  }
  for (std::size_t i = 0; i < map.edges.size(); ++i)
    snapshot.edges.push_back(
        {map.edges[i].from, map.edges[i].to, map.edges[i].kind, map.solution.edge_outlier[i]});
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

std::string describe(const MapCompleteness& completeness) {
  std::string text;
  if (completeness.pieces_not_joined > 0)
    text = counted(completeness.pieces_not_joined, "piece") + " not joined";
  if (completeness.frames_not_in_mesh > 0)
    append_sentence(text, counted(completeness.frames_not_in_mesh, "frame") + " not in the mesh");
  if (completeness.pieces_not_joined > 0) append_sentence(text, "touch a place between them");
  return text;
}

namespace {

nlohmann::json read_report(const std::filesystem::path& run_folder) {
  std::ifstream stream(run_folder / "report.json");
  return nlohmann::json::parse(stream, nullptr, /*allow_exceptions=*/false);
}

}  // namespace

std::optional<MapCompleteness> read_completeness(const std::filesystem::path& run_folder) {
  const nlohmann::json report = read_report(run_folder);
  try {
    const nlohmann::json& frames = report.at("frames");
    const auto components = report.at("components").get<int>();
    const auto not_in_mesh =
        frames.at("tracked").get<std::int64_t>() - frames.at("in_map").get<std::int64_t>();
    return MapCompleteness{std::max(components - 1, 0), std::max<std::int64_t>(not_in_mesh, 0)};
  } catch (const nlohmann::json::exception&) {
    return std::nullopt;
  }
}

std::vector<std::string> reservations(const MapCompleteness& completeness,
                                      const TrajectoryUncertainty& uncertainty) {
  std::vector<std::string> sentences = {describe(completeness), describe(uncertainty)};
  std::erase(sentences, "");
  return sentences;
}

std::vector<std::string> read_reservations(const std::filesystem::path& run_folder) {
  std::vector<std::string> sentences =
      reservations(read_completeness(run_folder).value_or(MapCompleteness{}), {});
  try {  // a scan that was not finished has none
    sentences.push_back(read_report(run_folder).at("uncertainty").at("description").get<std::string>());
  } catch (const nlohmann::json::exception&) {
    return sentences;
  }
  std::erase(sentences, "");
  return sentences;
}

}  // namespace gelslam
