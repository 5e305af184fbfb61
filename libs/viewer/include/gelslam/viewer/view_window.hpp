#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "gelslam/core/trajectory.hpp"
#include "gelslam/mesh/mesh.hpp"
#include "gelslam/slam/store.hpp"
#include "gelslam/viewer/scene_style.hpp"
#include "gelslam/viewer/window_options.hpp"

namespace gelslam {

/// How a run developed over time: times are seconds since the log's first frame, poses are in the map frame
/// (mm).
struct RunHistory {
  MapSnapshot session;
  std::vector<double> keyframes_s;      ///< Times of session.nodes, ascending.
  std::vector<StampedPose> trajectory;  ///< ascending in time

  double start_s() const;
  double end_s() const;
  /// Returns the keyframes and edges that existed at a time, as one component.
  MapSnapshot map_at(double time_s) const;
  /// Returns the trajectory up to a time, split where tracking was lost for more than a quarter of a second.
  std::vector<std::vector<Pose>> trajectory_at(double time_s) const;
};

/// Content that `gelslam view` can show.
struct ViewContent {
  std::string name;                        ///< Name of the file or folder, for the user.
  Mesh mesh;                               ///< mm
  std::optional<RunHistory> history;       ///< History of a run that has a session.
  std::vector<std::string> warnings = {};  ///< RunReport::result_warnings of a run.
};

/// Reads a run folder (mesh.ply, and session.db, keyframes.tum, trajectory.tum if present) or a mesh file (as
/// read_mesh()). Throws Error when there is nothing to show or a file is damaged.
ViewContent load_view(const std::filesystem::path& run_or_mesh);

/// Reads the true surface of a data folder, transformed to the map frame of a run on that folder's log; or a
/// mesh file unchanged. Throws Error when they do not belong together, or when the folder contains no true
/// surface.
ViewContent load_truth(const std::filesystem::path& data_folder_or_mesh, const std::filesystem::path& run);

struct ViewWindowOptions : viewer::WindowLoopOptions {
  ViewWindowOptions() { picture_stem = "view", poll_s = 0.25; }
  SceneStyle style;              ///< Initial style.
  std::optional<double> time_s;  ///< Initial time; empty: the end.
};

/// Shows a run or mesh, alone or beside a second one, until the user closes the window (docs/viewer.md). Must
/// be called from the main thread. Throws Error when there is no display.
void run_view_window(ViewContent first, std::optional<ViewContent> second, const ViewWindowOptions& options);

/// Draws the initial view of the window, without buttons and at full detail, without a display, and writes it
/// as PNG. Throws Error.
void write_view_snapshot(ViewContent first, std::optional<ViewContent> second,
                         const ViewWindowOptions& options, const std::filesystem::path& png);

}  // namespace gelslam
