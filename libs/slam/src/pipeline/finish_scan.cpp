#include <fmt/format.h>

#include <algorithm>
#include <map>
#include <utility>

#include "gelslam/core/median.hpp"
#include "gelslam/core/process.hpp"
#include "gelslam/core/se3.hpp"
#include "gelslam/core/text.hpp"
#include "gelslam/slam/continue_scan.hpp"
#include "gelslam/slam/map_snapshot.hpp"
#include "gelslam/slam/mapper.hpp"
#include "gelslam/slam/reconstruct.hpp"
#include "gelslam/slam/trajectory_uncertainty.hpp"

namespace gelslam {
namespace {

RunReport::Frames frame_counts(const SlamMap& map) {
  std::map<TrackStatus, std::int64_t> count;
  for (const FrameRecord& frame : map.frames) ++count[frame.status];
  RunReport::Frames frames{.total = std::ssize(map.frames),
                           .background = count[TrackStatus::background],
                           .no_contact = count[TrackStatus::no_contact],
                           .tracked = count[TrackStatus::tracked],
                           .lost = count[TrackStatus::lost]};
  frames.in_map = std::count_if(map.frames.begin(), map.frames.end(),
                                [&](const FrameRecord& frame) { return map.has_pose(frame); });
  frames.not_in_mesh = frames.tracked - frames.in_map;
  if (!map.frames.empty()) frames.left_out = map.frames.back().frame + 1 - frames.total;
  return frames;
}

/// Returns the log of each part and the time in the trajectory at which it begins.
std::vector<RunReport::Log> part_logs(const SlamMap& map) {
  const std::vector<double> stamps_s = map.stamps_s();
  std::vector<RunReport::Log> logs;
  for (const ScanPart& part : map.parts) {
    const auto next = std::find_if(map.frames.begin(), map.frames.end(),
                                   [&](const FrameRecord& frame) { return frame.frame >= part.first_frame; });
    double first_time_s = next == map.frames.begin() ? 0.0 : std::prev(next)->time_s + kBetweenPartsS;
    if (next != map.frames.end())
      first_time_s += stamps_s[static_cast<std::size_t>(next - map.frames.begin())] - next->time_s;
    logs.push_back({part.log, first_time_s});
  }
  return logs;
}

/// Returns "1 piece not joined; 16 frames not in the mesh; next time cross places that you touched before",
/// or "".
std::string not_in_mesh(int components, std::int64_t frames) {
  std::string text;
  if (components > 0) text = counted(components, "component") + " not joined";
  if (frames > 0) append_sentence(text, counted(frames, "frame") + " not in the mesh");
  if (components > 0) append_sentence(text, "next time cross places that you touched before");
  return text;
}

/// Speeds of the object relative to the sensor, from frame to frame.
struct Speeds {
  std::vector<double> mm_per_s, deg_per_s;

  void add(const FrameRecord& from, const FrameRecord& to) {
    const Vector6d moved = se3_log(from.keyframe_T_frame.inverse() * to.keyframe_T_frame);
    const double elapsed_s = std::max(to.time_s - from.time_s, 1e-3);
    mm_per_s.push_back(moved.tail<3>().norm() / elapsed_s);
    deg_per_s.push_back(moved.head<3>().norm() * kDegreesPerRadian / elapsed_s);
  }
};

/// Returns e.g. "46 of 60 touched frames are lost, after motions of ...; move more slowly ..." if more than 2
/// % of the touched frames are lost, else "". It does not blame the speed if the motions before lost frames
/// were slower than those that were tracked, as happens where a touch begins or ends.
std::string lost_frames(const SlamMap& map, const RunReport::Frames& count) {
  if (50 * count.lost <= count.tracked + count.lost) return "";
  Speeds followed, before_loss;
  for (std::size_t i = 1; i < map.frames.size(); ++i) {
    const FrameRecord &from = map.frames[i - 1], &to = map.frames[i];
    if (from.keyframe < 0 || from.keyframe != to.keyframe) continue;
    const bool is_last = i + 1 < map.frames.size() && map.frames[i + 1].status == TrackStatus::lost;
    (is_last ? before_loss : followed).add(from, to);
  }
  std::string text = fmt::format("{} of {} touched frames are lost", count.lost, count.tracked + count.lost);
  if (followed.mm_per_s.empty() || before_loss.mm_per_s.empty())
    return text + "; move more slowly, and press a little deeper";
  const double mm_per_s = median(followed.mm_per_s), deg_per_s = median(followed.deg_per_s),
               lost_mm_per_s = median(before_loss.mm_per_s), lost_deg_per_s = median(before_loss.deg_per_s);
  if (lost_mm_per_s <= mm_per_s && lost_deg_per_s <= deg_per_s) return text + "; press a little deeper";
  text += fmt::format(
      ", after motions of {:.0f} mm/s and {:.0f} degrees/s; {:.0f} mm/s and {:.0f} degrees/s were followed "
      "(medians); move more slowly, and press a little deeper",
      lost_mm_per_s, lost_deg_per_s, mm_per_s, deg_per_s);
  return text;
}

/// Returns e.g. "only 64 % of what was touched is in the mesh; ..." if it is less than 90 %, else "".
std::string little_in_mesh(const RunReport::Touched& touched) {
  if (touched.in_mesh_cm2 >= 0.9 * touched.area_cm2) return "";
  std::string text = fmt::format("only {:.0f} % of what was touched is in the mesh",
                                 100 * touched.in_mesh_cm2 / touched.area_cm2);
  const double rim_cm2 = touched.area_cm2 - touched.in_mesh_cm2 - touched.not_joined_cm2;
  // Otherwise another warning already says that components should be joined.
  if (rim_cm2 > touched.not_joined_cm2)
    append_sentence(text, "touch the missing places again in the middle of the gel");
  return text;
}

std::string why_no_mesh(const RunReport::Frames& frames) {
  if (frames.tracked > 0) return "no touch in the map is large enough, away from the border of the picture";
  if (frames.total > frames.background) return "nothing was touched; press the object on the gel";
  return "nothing was touched, and the background was not measured; begin with nothing on the gel, then "
         "press "
         "the object on it";
}

/// Returns what the user has to know about the quality of the result, most important first.
std::vector<std::string> result_warnings(const SlamMap& map, const RunReport& report) {
  double farthest_mm = 0;
  for (const StampedPose& pose : map.trajectory())
    farthest_mm = std::max(farthest_mm, pose.map_T_sensor.translation().norm());
  std::vector<std::string> sentences = describe(report.uncertainty, farthest_mm);
  if (std::string lost = lost_frames(map, report.frames); !lost.empty())
    sentences.insert(sentences.begin(), std::move(lost));
  if (std::string little = little_in_mesh(report.touched); !little.empty() && report.mesh.triangles > 0)
    sentences.insert(sentences.begin(), std::move(little));
  if (report.mesh.triangles == 0) sentences.insert(sentences.begin(), why_no_mesh(report.frames));
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
  report.start_unix_us = map.start_unix_us();
  // Includes damaged images after the last good frame.
  const std::int64_t damaged = report.frames.left_out;
  report.frames = frame_counts(map);
  report.frames.left_out = std::max(report.frames.left_out, damaged);
  report.uncertainty = map.uncertainty;
  report.keyframes = static_cast<int>(map.keyframes.size());
  report.trials = map.trials;
  report.components = map.components;
  report.loops = map.loops;
  const std::vector<bool>& outlier = map.solution.edge_outlier;
  report.loop_outliers = static_cast<int>(std::count(outlier.begin(), outlier.end(), true));
  report.gradient_scale = {map.gradient_scale().x, map.gradient_scale().y};
  report.mesh.vertices = run.mesh.vertices_mm.size();
  report.mesh.triangles = run.mesh.triangles.size();
  report.result_warnings = result_warnings(map, report);
}

}  // namespace

Mesh fuse_map(const SlamMap& map, const FusionOptions& options, ProgressSink* progress,
              std::int64_t* islands) {
  return fuse(posed_surfaces(snapshot_of(map)), options, map.gradient_scale().mean(), progress, islands);
}

Run finish_scan(const Config& config, SlamMap map, RunReport report, StageTimer& timer,
                std::chrono::steady_clock::time_point start, ProgressSink* progress) {
  Run run{config, std::move(map), {}, std::move(report)};
  {
    const auto scope = timer.measure("finish/fusion");
    return_free_memory();
    run.mesh = fuse_map(run.map, config.slam.fusion, progress, &run.report.mesh.islands_left_out);
    run.report.touched = touched_surface(snapshot_of(run.map), run.mesh, config.slam.fusion.threads);
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
    map = solve_scan(mapper.measured(record.frames), config.slam, true, stop_requested, &progress);
  }
  RunReport report;
  report.log_description = log_description;
  if (record.parts.size() == 1) report.log = record.parts.front().log;
  report.partial = stop_requested();
  return finish_scan(config, std::move(map), std::move(report), timer, start, &progress);
}

}  // namespace gelslam
