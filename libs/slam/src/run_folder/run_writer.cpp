#include "run_folder/run_writer.hpp"

#include <algorithm>
#include <map>

#include "gelslam/backend/g2o.hpp"
#include "gelslam/core/error.hpp"
#include "gelslam/core/file_descriptor.hpp"
#include "gelslam/core/files.hpp"
#include "gelslam/core/run_folder.hpp"
#include "gelslam/core/text.hpp"
#include "gelslam/core/trajectory.hpp"
#include "gelslam/mesh/mesh_io.hpp"
#include "gelslam/slam/continue_scan.hpp"
#include "gelslam/slam/mapper.hpp"
#include "gelslam/slam/store.hpp"
#include "gelslam/slam/trajectory_uncertainty.hpp"

namespace gelslam {
namespace {

namespace fs = std::filesystem;

std::string keyframe_trajectory(const SlamMap& map) {
  std::map<std::int64_t, double> time_s;
  for (const FrameRecord& frame : map.frames) time_s[frame.frame] = frame.time_s;
  std::string text;
  for (std::size_t id = 0; id < map.keyframes.size(); ++id)
    if (map.in_map[id])
      text += tum_line(time_s.at(map.keyframes[id]->frame), map.anchor_T_keyframe(static_cast<int>(id)));
  return text;
}

RunReport::Frames frame_counts(const SlamMap& map) {
  std::map<TrackStatus, std::int64_t> count;
  for (const FrameRecord& frame : map.frames) ++count[frame.status];
  RunReport::Frames frames{.total = std::ssize(map.frames),
                           .background = count[TrackStatus::background],
                           .no_contact = count[TrackStatus::no_contact],
                           .tracked = count[TrackStatus::tracked],
                           .lost = count[TrackStatus::lost],
                           .undone = count[TrackStatus::undone]};
  frames.in_map = std::count_if(map.frames.begin(), map.frames.end(),
                                [&](const FrameRecord& frame) { return map.has_pose(frame); });
  frames.not_in_mesh = frames.tracked - frames.in_map;
  if (!map.frames.empty())
    frames.left_out = map.frames.back().frame - map.frames.front().frame + 1 - frames.total;
  return frames;
}

/// The log of each part, and the time at which it begins.
std::vector<RunReport::Log> part_logs(const SlamMap& map) {
  std::vector<RunReport::Log> logs;
  for (const ScanPart& part : map.parts) {
    const auto next = std::find_if(map.frames.begin(), map.frames.end(),
                                   [&](const FrameRecord& frame) { return frame.frame >= part.first_frame; });
    const double first_time_s = next == map.frames.begin() ? 0.0 : std::prev(next)->time_s + kBetweenPartsS;
    logs.push_back({part.log, first_time_s});
  }
  return logs;
}

/// "1 piece not joined; 16 frames not in the mesh; next time cross places that you touched before", or "".
std::string not_in_mesh(int pieces, std::int64_t frames) {
  std::string text;
  if (pieces > 0) text = counted(pieces, "piece") + " not joined";
  if (frames > 0) append_sentence(text, counted(frames, "frame") + " not in the mesh");
  if (pieces > 0) append_sentence(text, "next time cross places that you touched before");
  return text;
}

/// What a user has to know beside the result.
std::vector<std::string> reservations(const RunReport& report) {
  std::vector<std::string> sentences = describe(report.uncertainty);
  if (!report.complete())
    sentences.insert(sentences.begin(),
                     not_in_mesh(std::max(report.components - 1, 0), report.frames.not_in_mesh));
  return sentences;
}

void count(const Run& run, RunReport& report) {
  const SlamMap& map = run.map;
  report.program = "gelslam " GELSLAM_VERSION;
  report.model = run.config.sensor.calibration_model_path.string();
  report.optics = {run.config.surface.optics, run.config.optics_from};
  report.parts = describe_parts(map);
  if (!report.parts.empty()) report.logs = part_logs(map);
  report.anchor_frame = map.anchor_frame;
  report.frames = frame_counts(map);
  report.uncertainty = map.uncertainty;
  report.keyframes = static_cast<int>(map.keyframes.size());
  report.trials = map.trials;
  report.components = map.components;
  report.loops = map.loops;
  const std::vector<bool>& outlier = map.solution.edge_outlier;
  report.loop_outliers = static_cast<int>(std::count(outlier.begin(), outlier.end(), true));
  report.reservations = reservations(report);
  report.gradient_scale = {map.gradient_scale.x, map.gradient_scale.y};
  report.mesh = {run.mesh.vertices_mm.size(), run.mesh.triangles.size()};
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
  for (std::size_t i = 0; i < map.solved_edges.size(); ++i) {
    const PoseGraphEdge& edge = map.solved_edges[i];
    if (in_map(edge.from) && in_map(edge.to) && map.solution.edge_outlier[i] == outliers)
      edges.push_back(edge);
  }
  return edges;
}

void move_file(const fs::path& from, const fs::path& to) {
  std::error_code code;
  fs::rename(from, to, code);
  if (code) throw Error(to.string() + ": cannot be written: " + code.message());
}

/// In the place of one that could not be written to. SQLite would take its log for that of the new one.
void replace_session(const fs::path& from, const fs::path& run) {
  std::error_code code;
  for (const char* beside : {"session.db-wal", "session.db-shm"}) fs::remove(run / beside, code);
  move_file(from, run / "session.db");
}

/// Of a message that names a file on its way: with the name that the file was to have.
std::string in_run(std::string message) {
  const std::string on_the_way = "saving.tmp/";
  const std::size_t at = message.find(on_the_way);
  return at == std::string::npos ? message : message.erase(at, on_the_way.size());
}

}  // namespace

Mesh fuse_map(const SlamMap& map, const FusionOptions& options, ProgressSink* progress) {
  FusionOptions fusion = options;
  fusion.gradient_scale = map.gradient_scale.mean();
  return fuse(posed_surfaces(map), fusion, progress);
}

Run finish_scan(const Config& config, SlamMap map, RunReport report, StageTimer& timer,
                std::chrono::steady_clock::time_point start, ProgressSink* progress) {
  Run run{config, std::move(map), {}, std::move(report)};
  {
    const auto scope = timer.measure("finish/fusion");
    run.mesh = fuse_map(run.map, config.slam.fusion, progress);
  }
  count(run, run.report);
  for (const StageStatistics& stage : timer.statistics()) run.report.stages[stage.stage] = stage;
  run.report.seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  return run;
}

Run finish_scan(const Config& config, const ScanRecord& record, const std::string& log_description,
                StageTimer& timer, std::chrono::steady_clock::time_point start, ProgressSink& progress,
                const std::function<bool()>& stop_requested) {
  SlamMap map;
  {
    const auto scope = timer.measure("finish/poses");
    Mapper mapper(config.slam);
    mapper.restore(record);
    map = mapper.finish(record.frames, true, stop_requested, &progress);
  }
  RunReport report;
  report.log_description = log_description;
  if (record.parts.size() == 1) report.log = record.parts.front().log;
  report.partial = stop_requested();
  return finish_scan(config, std::move(map), std::move(report), timer, start, &progress);
}

void write_run(const fs::path& folder, const Run& run) {
  write_results(folder, run);
  write_store(folder, run.map);
}

void write_results(const fs::path& folder, const Run& run) {
  const SlamMap& map = run.map;
  write_mesh(folder / "mesh.ply", run.mesh);
  write_file_atomically(folder / "trajectory.tum", tum_text(map.trajectory()));
  write_file_atomically(folder / "keyframes.tum", keyframe_trajectory(map));
  write_g2o(folder / "pose_graph.g2o", map_poses(map), map_edges(map, false));
  write_g2o_edges(folder / "loop_outliers.g2o", map_edges(map, true));
  write_file_atomically(folder / "config.yaml", write_config(run.config));
  write_file_atomically(folder / "report.json", report_json(run.report));
}

void replace_results(const fs::path& run, const std::function<void(const fs::path&)>& write,
                     const SlamMap* map) {
  const fs::path saving = run / "saving.tmp", saved = run / "saved.tmp";
  const bool was_incomplete = has_incomplete_save(run);
  std::error_code code;
  fs::remove_all(saving, code);
  if (!code) fs::create_directory(saving, code);
  if (code) throw Error(run.string() + ": cannot be written: " + code.message());
  try {
    write(saving);
  } catch (const Error& error) {
    fs::remove_all(saving, code);
    throw Error(in_run(error.what()));
  }
  fs::remove_all(saved, code);  // of a save that was killed
  move_file(saving, saved);
  if (fs::exists(saved / "session.db", code))
    replace_session(saved / "session.db", run);
  else if (map)
    try {
      Store(run).set_map(*map);
    } catch (const Error&) {  // all of it or nothing
      if (!was_incomplete) fs::remove_all(saved, code);
      throw;
    }
  for (const std::string& file : saved_entries())
    if (fs::exists(saved / file, code)) move_file(saved / file, run / file);
  sync_folder(run);
  fs::remove_all(saved, code);
}

}  // namespace gelslam
