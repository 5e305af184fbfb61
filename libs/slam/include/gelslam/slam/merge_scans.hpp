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

/// Joins scans of one object by the places that they have in common, as if they were one scan, and writes a
/// run folder. Throws Error when a run holds no session, another run into the folder is refused, or as
/// check_same_sensor(), and where it is stopped before all common places were looked for. Returns what it
/// wrote.
Run merge_scans(const MergeRequest& request, ProgressSink& progress,
                const std::function<bool()>& stop_requested);

struct FuseRequest {
  std::filesystem::path run;
  std::filesystem::path output;  ///< a new run folder; empty: the run's own mesh is replaced
  bool overwrite = false;
  std::optional<double> voxel_size_mm, truncation_mm;  ///< instead of those of the run's configuration
  bool keep_all = false;                               ///< also islands of the mesh
};

struct FuseSummary {
  std::size_t keyframes = 0;
  RunReport::MeshSize mesh{};
  RunReport::Touched touched{};
  bool map_was_made = false;  ///< the scan had not been finished
};

/// Makes a run's mesh again from its session; of a scan that was killed, its map, too. Throws Error.
FuseSummary fuse_run(const FuseRequest& request, ProgressSink& progress,
                     const std::function<bool()>& stop_requested);

}  // namespace gelslam
