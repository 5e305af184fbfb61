#include "gelslam/core/error.hpp"
#include "gelslam/core/run_folder.hpp"
#include "gelslam/core/run_report.hpp"
#include "gelslam/evaluation/run_and_truth.hpp"

namespace gelslam {
namespace {

/// Of a run of several logs the first one's poses are compared.
void keep_first_log(const RunReport& report, RunResult& run) {
  if (report.logs.size() < 2) return;
  const double end_s = report.logs[1].first_time_s;
  std::erase_if(run.trajectory, [&](const StampedPose& pose) { return pose.time_s >= end_s; });
  run.log_frames.reset();
}

void add_report(const RunReport& report, RunResult& run) {
  if (report.anchor_frame >= 0) run.anchor_frame = report.anchor_frame;
  run.trials = report.trials;
  run.components = report.components;
  // A run that was interrupted has seen only the beginning of its log.
  if (!report.partial && report.frames.left_out == 0) run.log_frames = report.frames.total;
  keep_first_log(report, run);
  const double start_s = stamp_s(report.start_unix_us.value_or(0), 0);
  for (StampedPose& pose : run.trajectory) pose.time_s -= start_s;  // the truth's times count from there
  if (report.mesh.triangles == 0) run.mesh_path.clear();
}

}  // namespace

RunResult read_run(const std::filesystem::path& folder_or_tum) {
  if (!std::filesystem::exists(folder_or_tum))
    throw Error("there is no " + folder_or_tum.string() + ": give a run's folder or a .tum file");
  const bool is_folder = std::filesystem::is_directory(folder_or_tum);
  if (is_folder) check_is_run(folder_or_tum);
  RunResult run;
  run.trajectory = read_tum(is_folder ? folder_or_tum / "trajectory.tum" : folder_or_tum);
  if (run.trajectory.empty())
    throw Error("the trajectory of " + folder_or_tum.string() + " is empty: nothing was tracked");
  if (!is_folder) return run;
  if (const auto mesh = folder_or_tum / "mesh.ply"; std::filesystem::exists(mesh)) run.mesh_path = mesh;
  if (const auto report = find_report(folder_or_tum)) add_report(*report, run);
  return run;
}

}  // namespace gelslam
