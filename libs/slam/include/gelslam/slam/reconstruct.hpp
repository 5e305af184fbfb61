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

/// A finished run in memory. save_run() writes it to a run folder.
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
  std::filesystem::path continued_run = {};  ///< Run whose scan this log continues; empty for a new scan.
};
/// Reconstructs a recorded log: tracking, loop closure, pose graph, refinement, fusion. The run folder exists
/// from the first frame on, and its session grows with every keyframe as in a live scan. When
/// `stop_requested` returns true, the function finishes with what it has, and the report is marked as
/// partial. Throws Error for mistakes in the input and as save_run(), if possible before the work begins.
Run reconstruct(const ReconstructRequest& request, ProgressSink& progress,
                const std::function<bool()>& stop_requested);

/// The last step of every scan: fuses the map and completes the report. `report` contains what only the
/// caller knows: the log, warnings, and whether the scan ended early. `start` is when the work began.
/// `progress` may be null.
Run finish_scan(const Config& config, SlamMap map, RunReport report, StageTimer& timer,
                std::chrono::steady_clock::time_point start, ProgressSink* progress);
/// As above, for a record whose map is solved first. The report is marked as partial if stopped.
Run finish_scan(const Config& config, const ScanRecord& record, const std::string& log_description,
                StageTimer& timer, std::chrono::steady_clock::time_point start, ProgressSink& progress,
                const std::function<bool()>& stop_requested);

/// Fuses all placed surfaces of the map to a mesh (map frame, mm), with heights and slopes corrected by the
/// gradient scale. `progress` (may be null) receives the task "fusing". `islands` (may be null) receives the
/// number of islands that were left out.
Mesh fuse_map(const SlamMap& map, const FusionOptions& options, ProgressSink* progress = nullptr,
              std::int64_t* islands = nullptr);

/// A small square of the surface that a keyframe shows, in the map frame (mm). The corners are in the order
/// of the image: upper left, upper right, lower left, lower right.
using TouchedSquare = std::array<Eigen::Vector3f, 4>;

/// Measures how much of the surface that keyframes show is in the mesh of fuse_map(). `not_in_mesh` (may be
/// null) receives the squares that are not in it, as far as their pose in the map is determined. A square
/// that several keyframes show is counted once for each.
RunReport::Touched touched_surface(const MapSnapshot& map, const Mesh& mesh, int threads,
                                   std::vector<TouchedSquare>* not_in_mesh = nullptr);

/// Writes a run folder (docs/file-formats.md), completely or not at all. Throws Error when the folder exists
/// and `overwrite` is false, when it contains files that this program does not write, or when the disk is
/// full.
void save_run(const std::filesystem::path& folder, const Run& run, bool overwrite = false);

}  // namespace gelslam
