#include "gelslam/viewer/view_content.hpp"

#include <algorithm>
#include <iterator>
#include <limits>
#include <system_error>

#include "gelslam/core/error.hpp"
#include "gelslam/core/files.hpp"
#include "gelslam/core/run_folder.hpp"
#include "gelslam/core/run_report.hpp"
#include "gelslam/evaluation/evaluation.hpp"
#include "gelslam/mesh/mesh_io.hpp"

namespace gelslam {
namespace {

namespace fs = std::filesystem;

/// `start_s`: in the run's trajectories; here times count from there.
RunHistory read_history(const fs::path& run, double start_s) {
  RunHistory history{load_session(run), {}, read_tum(run / "trajectory.tum")};
  for (StampedPose& pose : history.trajectory) pose.time_s -= start_s;
  for (const StampedPose& keyframe : read_tum(run / "keyframes.tum"))
    history.keyframes_s.push_back(keyframe.time_s - start_s);
  if (history.keyframes_s.size() != history.session.patches.size())
    throw Error(run.string() + ": keyframes.tum lists " + std::to_string(history.keyframes_s.size()) +
                " keyframes, session.db " + std::to_string(history.session.patches.size()) +
                "; the folder holds files of two runs");
  return history;
}

ViewContent load_run(const fs::path& run) {
  check_is_run(run);
  const bool has_mesh = fs::exists(run / "mesh.ply"), has_session = fs::exists(run / "session.db");
  if (!has_mesh) throw Error(run.string() + ": holds no mesh.ply; give a run folder or a mesh file");
  ViewContent content{name_of(run), read_mesh(run / "mesh.ply"), std::nullopt};
  const RunReport report = find_report(run).value_or(RunReport());
  content.warnings = report.reservations;
  if (has_session) content.history = read_history(run, stamp_s(report.start_unix_us.value_or(0), 0));
  return content;
}

void check_exists(const fs::path& path) {
  std::error_code code;
  if (!fs::exists(path, code)) throw Error(path.string() + ": no such file or folder");
}

}  // namespace

double RunHistory::start_s() const {
  double start_s = std::numeric_limits<double>::infinity();
  if (!trajectory.empty()) start_s = trajectory.front().time_s;
  if (!keyframes_s.empty()) start_s = std::min(start_s, keyframes_s.front());
  return start_s;
}

double RunHistory::end_s() const {
  double end_s = -std::numeric_limits<double>::infinity();
  if (!trajectory.empty()) end_s = trajectory.back().time_s;
  if (!keyframes_s.empty()) end_s = std::max(end_s, keyframes_s.back());
  return end_s;
}

MapSnapshot RunHistory::map_at(double time_s) const {
  MapSnapshot map;
  map.shown_component = 0;
  for (std::size_t i = 0; i < keyframes_s.size() && keyframes_s[i] <= time_s; ++i) {
    const PosedSurface& patch = session.patches[i];
    map.nodes.push_back({.keyframe = patch.id,
                         .component = map.shown_component,
                         .component_T_keyframe = patch.map_T_keyframe,
                         .surface = patch.surface});
  }
  std::copy_if(session.edges.begin(), session.edges.end(), std::back_inserter(map.edges),
               [&](const MapSnapshot::Edge& e) { return map.find(e.from) && map.find(e.to); });
  return map;
}

std::vector<std::vector<Pose>> RunHistory::trajectory_at(double time_s) const {
  const auto end = std::ranges::upper_bound(trajectory, time_s, {}, &StampedPose::time_s);
  return unbroken_pieces({trajectory.begin(), end});
}

ViewContent load_view(const fs::path& run_or_mesh) {
  check_exists(run_or_mesh);
  if (fs::is_directory(run_or_mesh)) return load_run(run_or_mesh);
  return {name_of(run_or_mesh), read_mesh(run_or_mesh), std::nullopt};
}

ViewContent load_truth(const fs::path& data_folder_or_mesh, const fs::path& run) {
  check_exists(data_folder_or_mesh);
  if (!fs::is_directory(data_folder_or_mesh)) return load_view(data_folder_or_mesh);
  const Comparison comparison = compare(run, data_folder_or_mesh);
  const GroundTruth& truth = comparison.truth;
  if (truth.mesh_path.empty() || !truth.object_T_start)
    throw Error(data_folder_or_mesh.string() +
                ": knows no true surface (gt_mesh.ply and its place in meta.json)");
  const Pose object_T_map = *truth.object_T_start * comparison.start_T_map;
  return {"truth", transformed(read_mesh(truth.mesh_path), object_T_map.inverse()), std::nullopt};
}

}  // namespace gelslam
