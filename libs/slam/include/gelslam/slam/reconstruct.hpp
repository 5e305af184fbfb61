#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "gelslam/core/progress.hpp"
#include "gelslam/core/stage_timer.hpp"
#include "gelslam/mesh/mesh.hpp"
#include "gelslam/slam/config.hpp"
#include "gelslam/slam/slam_map.hpp"

namespace gelslam {

/// The figures of a finished run; report.json holds them too.
struct ReconstructSummary {
  std::int64_t frames = 0, tracked = 0, in_map = 0;
  int keyframes = 0, trials = 0, components = 0, loops = 0;
  MapCompleteness completeness;  ///< what was tracked but is not in the mesh
  TrajectoryUncertainty uncertainty;
  bool has_rig = false;        ///< two sensors at the same time
  std::optional<RigPose> rig;  ///< nothing: it is not determined
  std::size_t vertices = 0, triangles = 0;
  double seconds = 0;
  bool partial = false;               ///< stopped before the log's end
  std::vector<std::string> warnings;  ///< what was not right with the log, for people
  std::vector<std::string> parts;     ///< describe_parts()
};

/// How a live scan went, beside its map.
struct LiveAccount {
  double rate_hz = 0;
  std::int64_t arrived = 0, lost_by_camera = 0, dropped = 0, damaged = 0;
};

/// What report.json states beside the map.
struct RunAccount {
  std::filesystem::path log;  ///< empty: none was kept
  std::string log_description;
  std::vector<StageStatistics> times;
  ReconstructSummary summary;
  std::optional<LiveAccount> live;
  /// Size in bytes of the record that a live scan writes, when the map was requested. Empty: there is no
  /// record, or it is incomplete.
  std::optional<std::uintmax_t> scan_bytes = {};
};

/// A run in memory. save_run() makes a run folder of it.
struct Run {
  Config config;
  SlamMap map;  ///< map.trajectory() has the poses
  Mesh mesh;    ///< map frame (SlamMap), mm
  RunAccount account;
};

/// A recorded log becomes a map and its mesh: tracking, loop closure, pose graph, refinement, fusion.
/// `config` is that of resolve_config(); `continued_run`: the run folder whose scan this log continues. When
/// `stop_requested` turns true it ends with what it has, and the summary says partial. Throws Error on a
/// mistake in the input.
Run reconstruct(const LogInput& input, const Config& config, ProgressSink& progress,
                const std::function<bool()>& stop_requested, const std::filesystem::path& continued_run = {});

/// The same without the mesh. The account holds no times and counts; `timer` takes the times.
Run map_log(const LogInput& input, const Config& config, ProgressSink& progress,
            const std::function<bool()>& stop_requested, const std::filesystem::path& continued_run,
            StageTimer& timer);

/// The map's surface: all patches of the largest component, with the gradient scale taken out. Map frame, mm.
/// `progress` (may be null) receives the task "fusing".
Mesh fuse_map(const SlamMap& map, const FusionOptions& options, ProgressSink* progress = nullptr);

/// Counts of the map and its mesh.
ReconstructSummary summarize(const SlamMap& map, const Mesh& mesh);

/// The text of report.json.
std::string report_json(const Run& run);

/// Writes a run folder (docs/file-formats.md), whole or not at all. Throws Error when the folder exists and
/// is not to be replaced, or holds what is not ours, or the disk is full.
void save_run(const std::filesystem::path& folder, const Run& run, bool overwrite = false);

/// The same for the program, which checks the folder before the work begins. No folder is left behind when
/// it throws.
struct ReconstructRequest {
  LogInput input;
  Config config;  ///< from resolve_config()
  std::filesystem::path run_folder;
  bool overwrite = false;
  std::filesystem::path continued_run = {};  ///< empty: a new scan
};
ReconstructSummary reconstruct(const ReconstructRequest& request, ProgressSink& progress,
                               const std::function<bool()>& stop_requested);

}  // namespace gelslam
