#pragma once

#include <filesystem>
#include <functional>
#include <string>

#include "gelslam/core/progress.hpp"
#include "gelslam/slam/map_completeness.hpp"
#include "gelslam/slam/surface_stream.hpp"

namespace gelslam {

struct ReconstructRequest {
  LogInput input;
  Config config;  ///< from resolve_config()
  std::filesystem::path run_folder;
  bool overwrite = false;
  std::string program_version;
};

/// The figures of a finished run; report.json holds them too.
struct ReconstructSummary {
  std::int64_t frames = 0, tracked = 0, in_map = 0;
  int keyframes = 0, trials = 0, components = 0, loops = 0;
  MapCompleteness completeness;  ///< what was tracked but is not in the mesh
  std::size_t vertices = 0, triangles = 0;
  double seconds = 0;
  bool partial = false;  ///< stopped before the log's end
  std::string warning;   ///< what was not right with the log, or ""
};

/// A recorded log becomes a run folder (DESIGN §6): tracking, loop closure, pose graph, refinement, fusion.
/// When `stop_requested` turns true it ends with what it has, and the report says partial. Throws Error on a
/// person's mistake, and then leaves no folder behind.
ReconstructSummary reconstruct(const ReconstructRequest& request, ProgressSink& progress,
                               const std::function<bool()>& stop_requested);

}  // namespace gelslam
