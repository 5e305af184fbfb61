#pragma once

#include <filesystem>
#include <optional>
#include <vector>

#include "gelslam/core/trajectory.hpp"

namespace gelslam {

/// What a run left behind, as far as it is judged. Counts are absent where there is no report.json.
struct RunResult {
  std::vector<StampedPose> trajectory;
  std::optional<int> anchor_frame;  ///< log frame whose sensor frame is the frame of trajectory and mesh
  std::optional<int> log_frames;    ///< absent too when the run was interrupted or left frames out
  std::optional<int> trials;
  std::optional<int> components;
  std::filesystem::path mesh_path;  ///< empty where the run made none, or one without triangles
};

/// Reads a run's folder (trajectory.tum; report.json and mesh.ply where present) or a bare .tum file.
/// Throws Error when the trajectory is missing, empty or damaged, or report.json is no JSON object of the
/// right types.
RunResult read_run(const std::filesystem::path& folder_or_tum);

}  // namespace gelslam
