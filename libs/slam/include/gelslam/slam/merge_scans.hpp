#pragma once

#include <filesystem>
#include <functional>
#include <optional>
#include <vector>

#include "gelslam/core/progress.hpp"
#include "gelslam/slam/reconstruct.hpp"

namespace gelslam {

struct MergeRequest {
  std::vector<std::filesystem::path> runs;  ///< at least two; the first one's configuration is used
  std::filesystem::path run_folder;
  bool overwrite = false;
};

/// Merges scans of one object into one: searches for loops between them as if they were parts of one scan,
/// and writes a run folder. Returns the run. Throws Error when a run has no session, when the run folder may
/// not be written, as check_same_sensor(), and when it is stopped before all loops were searched for.
Run merge_scans(const MergeRequest& request, ProgressSink& progress,
                const std::function<bool()>& stop_requested);

struct FuseRequest {
  std::filesystem::path run;
  std::filesystem::path output;  ///< A new run folder; if empty, the mesh of the run itself is replaced.
  bool overwrite = false;
  std::optional<double> voxel_size_mm, truncation_mm;  ///< Replace the values of the run's configuration.
  bool keep_all = false;                               ///< Also keeps small islands of the mesh.
};

struct FuseSummary {
  std::size_t keyframes = 0;
  RunReport::MeshSize mesh{};
  RunReport::Touched touched{};
  bool map_was_made = false;  ///< True if the run had no map because its scan had not been finished.
};

/// Fuses the mesh of a run again from its session. If the scan was killed, its map is made first. Throws
/// Error.
FuseSummary fuse_run(const FuseRequest& request, ProgressSink& progress,
                     const std::function<bool()>& stop_requested);

}  // namespace gelslam
