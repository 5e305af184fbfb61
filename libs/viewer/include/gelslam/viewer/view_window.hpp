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

/// How a run came about, for looking back: times are seconds since the log's first frame, poses in the map
/// frame, mm.
struct RunHistory {
  MapSnapshot session;
  std::vector<double> keyframes_s;      ///< of session.nodes, ascending
  std::vector<StampedPose> trajectory;  ///< ascending in time

  double start_s() const;
  double end_s() const;
  /// Keyframes and edges that were there at a time, as one component.
  MapSnapshot map_at(double time_s) const;
  /// The trajectory up to a time, cut where tracking was lost for more than a quarter of a second.
  std::vector<std::vector<Pose>> trajectory_at(double time_s) const;
};

/// What `gelslam view` can show.
struct ViewContent {
  std::string name;                        ///< of the file or folder, for people
  Mesh mesh;                               ///< mm
  std::optional<RunHistory> history;       ///< of a run that kept its session
  std::vector<std::string> warnings = {};  ///< RunReport::result_warnings of a run
};

/// Opens a run folder (mesh.ply, and session.db, keyframes.tum, trajectory.tum where they are)
/// or a mesh file (as read_mesh()). Throws Error when there is nothing to show or a file is damaged.
ViewContent load_view(const std::filesystem::path& run_or_mesh);

/// The true surface of a data folder, moved into the map frame of a run on that folder's log; or a mesh file
/// as it is. Throws Error when they do not belong together or the folder knows no true surface.
ViewContent load_truth(const std::filesystem::path& data_folder_or_mesh, const std::filesystem::path& run);

struct ViewWindowOptions : viewer::WindowLoopOptions {
  ViewWindowOptions() { picture_stem = "view", poll_s = 0.25; }
  SceneStyle style;              ///< at first
  std::optional<double> time_s;  ///< at first; empty: the end
};

/// Looks at a run or mesh, alone or beside a second one, until the person closes the window: turning, time,
/// colors, pictures (docs/viewer.md). Main thread. Throws Error when there is no display.
void run_view_window(ViewContent first, std::optional<ViewContent> second, const ViewWindowOptions& options);

/// What the window would show first, without its buttons, drawn at full detail without a display and written
/// as PNG. Throws Error.
void write_view_snapshot(ViewContent first, std::optional<ViewContent> second,
                         const ViewWindowOptions& options, const std::filesystem::path& png);

}  // namespace gelslam
