#pragma once

#include <filesystem>
#include <optional>
#include <vector>

#include "gelslam/core/se3.hpp"

namespace gelslam {

/// One line of a trajectory file: the sensor's pose in the map at a time since the log's first frame.
struct StampedPose {
  double time_s = 0.0;
  Pose map_T_sensor = Pose::Identity();
};

/// Reads a TUM trajectory: lines of `time_s x y z qx qy qz qw`, metres, blank lines and lines with `#`
/// skipped. Translations come back in millimetres. Throws Error, naming file and line, when the file cannot
/// be read, a line has not eight finite numbers, a quaternion is not of unit length (within 1 %), or times do
/// not increase.
std::vector<StampedPose> read_tum(const std::filesystem::path& path);

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
