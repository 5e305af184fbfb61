#pragma once

#include <filesystem>
#include <optional>
#include <vector>

#include "gelslam/core/se3.hpp"

namespace gelslam {

/// Ground truth of a recorded log. `start` is the sensor's frame at the first contact.
struct GroundTruth {
  std::vector<std::optional<Pose>>
      start_T_currs;           ///< One pose per frame after the background; none without contact.
  int background_frames = 10;  ///< Frames of the log before start_T_currs[0].
  double fps = 25.0;
  /// For a truth that was matched by time: the time of the first pose that both trajectories have.
  std::optional<double> start_s{};
  std::optional<Pose> object_T_start;  ///< Aligns a reconstruction with the true mesh.
  std::filesystem::path mesh_path;     ///< The object's true surface; empty if there is none.
  /// Points that were touched, in the object frame; empty if not known.
  std::vector<Eigen::Vector3d> touched_mm;

  int log_frames() const { return background_frames + static_cast<int>(start_T_currs.size()); }
};

/// Returns true_start_T_currs.npy in a data folder, or true_transforms.npy, its name in older public data.
std::filesystem::path truth_file(const std::filesystem::path& folder);

/// Reads a data folder: truth_file() (N x 4 x 4, meters, NaN where nothing touches); optional
/// meta.json (background_frames, fps, frames, start_T_object), config.yaml (device_config.framerate, where
/// meta.json has no fps), gt_mesh.ply, touched.npy (M x 3, meters, object frame). Throws Error when the
/// folder or the truth is missing or damaged, nothing ever touches, a pose is not rigid, or the truth is of
/// another length than the log.
GroundTruth read_ground_truth(const std::filesystem::path& folder);

}  // namespace gelslam
