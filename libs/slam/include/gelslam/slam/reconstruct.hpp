#pragma once

#include <array>
#include <chrono>
#include <filesystem>
#include <functional>
#include <vector>

#include "gelslam/core/progress.hpp"
#include "gelslam/core/run_report.hpp"
#include "gelslam/core/stage_timer.hpp"
#include "gelslam/mesh/mesh.hpp"
#include "gelslam/slam/config.hpp"
#include "gelslam/slam/slam_map.hpp"

namespace gelslam {

/// A run in memory. save_run() makes a run folder of it.
struct Run {
  Config config;
  SlamMap map;  ///< map.trajectory() has the poses
  Mesh mesh;    ///< map frame (SlamMap), mm
  RunReport report;
};

struct ReconstructRequest {
  LogInput input;
  Config config;                             ///< from resolve_config()
  std::filesystem::path run_folder = {};     ///< empty: none
  bool overwrite = false;                    ///< of the run folder
  std::filesystem::path continued_run = {};  ///< whose scan this log continues; empty: a new scan
};
/// A recorded log becomes a map and its mesh: tracking, loop closure, pose graph, refinement, fusion. A run
/// folder is there from the first frame on: its session grows with every keyframe, as that of a live scan.
/// When `stop_requested` turns true it ends with what it has, and the summary says partial. Throws Error on a
/// mistake in the input, and as save_run(), where possible before the work begins.
Run reconstruct(const ReconstructRequest& request, ProgressSink& progress,
                const std::function<bool()>& stop_requested);

/// The end of every scan: its map is fused, and both are counted. `report`: what only the scan knows, its
/// log, warnings, and whether it ended early. `start`: of the work. `progress` may be null.
Run finish_scan(const Config& config, SlamMap map, RunReport report, StageTimer& timer,
                std::chrono::steady_clock::time_point start, ProgressSink* progress);
/// The same of what was measured, whose map is made first. The report says partial when stopped.
Run finish_scan(const Config& config, const ScanRecord& record, const std::string& log_description,
                StageTimer& timer, std::chrono::steady_clock::time_point start, ProgressSink& progress,
                const std::function<bool()>& stop_requested);

/// The map's surface: all its patches, with the gradient scale taken out. Map frame, mm.
/// `progress` (may be null) receives the task "fusing".
Mesh fuse_map(const SlamMap& map, const FusionOptions& options, ProgressSink* progress = nullptr,
              std::int64_t* islands = nullptr);

/// A small part of what a keyframe shows, map frame, mm: its corners as a picture of the gel has them, upper
/// left, upper right, lower left, lower right.
using TouchedSquare = std::array<Eigen::Vector3f, 4>;

/// How much of what keyframes show is in the mesh of fuse_map(). `not_in_mesh` (may be null) receives what is
/// not, as far as its place in the map is known; where keyframes show it more than once, so often.
RunReport::Touched touched_surface(const MapSnapshot& map, const Mesh& mesh, int threads,
                                   std::vector<TouchedSquare>* not_in_mesh = nullptr);

/// Writes a run folder (docs/file-formats.md), whole or not at all. Throws Error when the folder exists and
/// is not to be replaced, or holds what is not ours, or the disk is full.
void save_run(const std::filesystem::path& folder, const Run& run, bool overwrite = false);

}  // namespace gelslam
