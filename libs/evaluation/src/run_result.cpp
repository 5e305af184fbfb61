#include "gelslam/evaluation/run_result.hpp"

#include "gelslam/core/error.hpp"
#include "json_file.hpp"

namespace gelslam {
namespace {

void read_report(const std::filesystem::path& path, RunResult& run) {
  using evaluation::detail::integer_at;
  const nlohmann::json report = evaluation::detail::read_json_object(path);
  run.anchor_frame = integer_at(report, "anchor_frame", 0, path);
  run.log_frames = integer_at(report, "frames", 0, path);
  run.trials = integer_at(report, "trials", 0, path);
  run.groups = integer_at(report, "groups", 0, path);
}

}  // namespace

RunResult read_run(const std::filesystem::path& folder_or_tum) {
  if (!std::filesystem::exists(folder_or_tum)) {
    throw Error("there is no " + folder_or_tum.string() + ": give a run's folder or a .tum file");
  }
  const bool is_folder = std::filesystem::is_directory(folder_or_tum);
  RunResult run;
  run.trajectory = read_tum(is_folder ? folder_or_tum / "trajectory.tum" : folder_or_tum);
  if (run.trajectory.empty()) {
    throw Error("the trajectory of " + folder_or_tum.string() + " is empty: nothing was tracked");
  }
  if (!is_folder) return run;
  if (const auto report = folder_or_tum / "report.json"; std::filesystem::exists(report))
    read_report(report, run);
  if (const auto mesh = folder_or_tum / "mesh.ply"; std::filesystem::exists(mesh)) run.mesh_path = mesh;
  return run;
}

}  // namespace gelslam
