#include "run_folder/run_writer.hpp"

#include <algorithm>
#include <array>
#include <map>
#include <nlohmann/json.hpp>

#include "gelslam/backend/g2o.hpp"
#include "gelslam/core/files.hpp"
#include "gelslam/core/index.hpp"
#include "gelslam/core/trajectory.hpp"
#include "gelslam/mesh/mesh_io.hpp"
#include "gelslam/slam/continue_scan.hpp"
#include "gelslam/slam/session.hpp"
#include "gelslam/slam/trial_drift.hpp"
#include "run_folder/session_text.hpp"

namespace gelslam {
namespace {

namespace fs = std::filesystem;
using nlohmann::ordered_json;

std::string keyframe_trajectory(const SlamMap& map) {
  std::map<std::int64_t, double> time_s;
  for (const FrameRecord& frame : map.frames) time_s[frame.frame] = frame.time_s;
  std::string text;
  for (std::size_t id = 0; id < map.keyframes.size(); ++id)
    if (map.in_map[id])
      text += tum_line(time_s.at(map.keyframes[id]->frame), map.anchor_T_keyframe(static_cast<int>(id)));
  return text;
}

/// Frames between the first and the last that were damaged or dropped.
std::int64_t frames_left_out(const std::vector<FrameRecord>& frames) {
  if (frames.empty()) return 0;
  return frames.back().frame - frames.front().frame + 1 - static_cast<std::int64_t>(frames.size());
}

ordered_json frame_counts(const SlamMap& map, const ReconstructSummary& summary) {
  std::map<TrackStatus, int> count;
  for (const FrameRecord& frame : map.frames) ++count[frame.status];
  ordered_json frames;
  frames["total"] = map.frames.size();
  for (const TrackStatus status : {TrackStatus::background, TrackStatus::no_contact, TrackStatus::tracked,
                                   TrackStatus::lost, TrackStatus::undone})
    frames[std::string(name(status))] = count[status];
  frames["in_map"] = summary.in_map;
  frames["not_in_mesh"] = summary.completeness.frames_not_in_mesh;
  frames["left_out"] = frames_left_out(map.frames);
  return frames;
}

ordered_json stage_times(const std::vector<StageStatistics>& times) {
  ordered_json stages;
  for (const StageStatistics& s : times)
    stages[s.stage] = {{"count", s.count},
                       {"median_ms", s.median_ms},
                       {"p95_ms", s.p95_ms},
                       {"max_ms", s.max_ms},
                       {"total_ms", s.total_ms}};
  return stages;
}

ordered_json live_account(const LiveAccount& live) {
  return {{"rate_hz", live.rate_hz},
          {"arrived", live.arrived},
          {"lost_by_camera", live.lost_by_camera},
          {"dropped", live.dropped},
          {"damaged", live.damaged}};
}

/// The log of each part, and the time at which it begins. Of two sensors at the same time, also which one it
/// is of, and when that started by the first one's clock.
ordered_json part_logs(const SlamMap& map) {
  ordered_json logs = ordered_json::array();
  const std::vector<ScanPart>& parts = map.measured.parts;
  const bool of_two =
      std::any_of(parts.begin(), parts.end(), [](const auto& part) { return part.second_start_s; });
  for (const ScanPart& part : parts) {
    const auto next = std::find_if(map.frames.begin(), map.frames.end(),
                                   [&](const FrameRecord& frame) { return frame.frame >= part.first_frame; });
    const double first_time_s = next == map.frames.begin() ? 0.0 : std::prev(next)->time_s + kBetweenPartsS;
    logs.push_back({{"file", part.log}, {"first_time_s", first_time_s}});
    if (!of_two) continue;
    logs.back().update(
        {{"sensor", part.second_start_s ? 1 : 0}, {"start_s", part.second_start_s.value_or(first_time_s)}});
  }
  return logs;
}

ordered_json uncertainty_fields(const TrajectoryUncertainty& uncertainty) {
  constexpr std::array<const char*, 6> kMotions = {"x", "y", "z", "rx", "ry", "rz"};
  const auto drift = [](const TrajectoryUncertainty::Drift& worst) {
    return ordered_json{{"amount", worst.amount}, {"frame", worst.frame}, {"time_s", worst.time_s}};
  };
  ordered_json fields = {{"drift_mm", drift(uncertainty.mm)},
                         {"drift_deg", drift(uncertainty.deg)},
                         {"not_observable", ordered_json::array()}};
  for (const TrajectoryUncertainty::Hidden& hidden : uncertainty.hidden)
    fields["not_observable"].push_back({{"motion", kMotions[hidden.motion]},
                                        {"first_frame", hidden.first_frame},
                                        {"first_time_s", hidden.first_time_s},
                                        {"frames", hidden.frames}});
  return fields;
}

ordered_json rig_fields(const SlamMap& map) {
  const Vector6d sigma = sigma_of(map.rig->covariance);
  ordered_json sigma_mm = ordered_json::array(), sigma_deg = ordered_json::array();
  for (int row = 0; row < 3; ++row) {
    sigma_deg.push_back(sigma[row] * kDegreesPerRadian);
    sigma_mm.push_back(sigma[3 + row]);
  }
  return {{"first_T_second_mm", slam::detail::numbers(map.rig->first_T_second)},
          {"sigma_mm", sigma_mm},
          {"sigma_deg", sigma_deg},
          {"constraints", map.measured.rig.constraints.size()},
          {"second_start_s", map.measured.rig.second_start_s}};
}

ordered_json optics_fields(const Config& config) {
  ordered_json fields = {{"from", config.optics_from}};
  fields.update(ordered_json(config.surface.optics));
  return fields;
}

ordered_json report(const Config& config, const SlamMap& map, const RunAccount& account) {
  const ReconstructSummary& summary = account.summary;
  ordered_json json;
  json["program"] = "gelslam " GELSLAM_VERSION;
  if (!account.log.empty()) json["log"] = fs::absolute(account.log).lexically_normal().string();
  json["log_description"] = account.log_description;
  json["model"] = config.sensor.calibration_model_path.string();
  json["optics"] = optics_fields(config);
  json["partial"] = summary.partial;
  if (!summary.warnings.empty()) json["warnings"] = summary.warnings;
  json["reservations"] = reservations(summary.completeness, summary.uncertainty);
  if (!summary.parts.empty()) {
    json["parts"] = summary.parts;
    json["logs"] = part_logs(map);
  }
  json["anchor_frame"] = map.anchor_frame;
  json["frames"] = frame_counts(map, summary);
  json["uncertainty"] = uncertainty_fields(summary.uncertainty);
  if (map.rig) json["rig"] = rig_fields(map);
  json["keyframes"] = summary.keyframes;
  json["coverage_keyframes"] = map.coverage_keyframes.size();
  json["trials"] = summary.trials;
  json["components"] = summary.components;
  json["loops"] = summary.loops;
  json["loop_outliers"] =
      std::count(map.solution.edge_outlier.begin(), map.solution.edge_outlier.end(), true);
  const GradientScale scale = map.slope_correction.scale();
  json["gradient_scale"] = {{"x", scale.x}, {"y", scale.y}};
  json["mesh"] = {{"vertices", summary.vertices}, {"triangles", summary.triangles}};
  json["seconds"] = summary.seconds;
  if (account.live) json["live"] = live_account(*account.live);
  json["stages"] = stage_times(account.times);
  return json;
}

/// What is not UTF-8 (of file names) is replaced.
std::string text(const ordered_json& json) {
  return json.dump(2, ' ', false, ordered_json::error_handler_t::replace) + "\n";
}

std::map<int, Pose> map_poses(const SlamMap& map) {
  std::map<int, Pose> poses;
  for (std::size_t id = 0; id < map.keyframes.size(); ++id)
    if (map.in_map[id]) poses[static_cast<int>(id)] = map.anchor_T_keyframe(static_cast<int>(id));
  return poses;
}

/// The outliers (loops that the rest contradicts), or all other edges.
std::vector<PoseGraphEdge> map_edges(const SlamMap& map, bool outliers) {
  const auto in_map = [&](int id) { return map.in_map[static_cast<std::size_t>(id)]; };
  std::vector<PoseGraphEdge> edges;
  for (std::size_t i = 0; i < map.edges.size(); ++i) {
    const PoseGraphEdge& edge = map.edges[i];
    if (in_map(edge.from) && in_map(edge.to) && map.solution.edge_outlier[i] == outliers)
      edges.push_back(edge);
  }
  return edges;
}

}  // namespace

ReconstructSummary summarize(const SlamMap& map, const Mesh& mesh) {
  ReconstructSummary summary;
  summary.frames = static_cast<std::int64_t>(map.frames.size());
  summary.tracked = std::count_if(map.frames.begin(), map.frames.end(),
                                  [](const FrameRecord& f) { return f.status == TrackStatus::tracked; });
  summary.in_map = std::count_if(map.frames.begin(), map.frames.end(),
                                 [&](const FrameRecord& f) { return map.has_pose(f); });
  summary.completeness.pieces_not_joined = std::max(map.components - 1, 0);
  summary.completeness.frames_not_in_mesh = summary.tracked - summary.in_map;
  summary.uncertainty = map.uncertainty;
  summary.has_rig = !map.measured.rig.constraints.empty();
  summary.rig = map.rig;
  summary.keyframes = static_cast<int>(map.keyframes.size());
  summary.trials = map.trials;
  summary.components = map.components;
  summary.loops = map.loops;
  summary.vertices = mesh.vertices_mm.size();
  summary.triangles = mesh.triangles.size();
  summary.parts = describe_parts(map);
  return summary;
}

Mesh fuse_map(const SlamMap& map, const FusionOptions& options, ProgressSink* progress) {
  FusionOptions fusion = options;
  fusion.gradient_scale = map.slope_correction.scale().mean();
  return fuse(posed_surfaces(map), fusion, progress);
}

std::string report_json(const Run& run) { return text(report(run.config, run.map, run.account)); }

void write_run(const fs::path& folder, const Config& config, const SlamMap& map, const Mesh& mesh,
               const RunAccount& account) {
  write_results(folder, config, map, mesh, account);
  save_session(folder / "session", map);
}

void write_results(const fs::path& folder, const Config& config, const SlamMap& map, const Mesh& mesh,
                   const RunAccount& account) {
  write_mesh(folder / "mesh.ply", mesh);
  write_file_atomically(folder / "trajectory.tum", tum_text(map.trajectory()));
  write_file_atomically(folder / "keyframes.tum", keyframe_trajectory(map));
  write_g2o(folder / "pose_graph.g2o", map_poses(map), map_edges(map, false));
  write_g2o_edges(folder / "loop_outliers.g2o", map_edges(map, true));
  write_file_atomically(folder / "config.yaml", write_config(config));
  write_file_atomically(folder / "report.json", text(report(config, map, account)));
}

}  // namespace gelslam
