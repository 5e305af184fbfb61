#include "gelslam/core/error.hpp"
#include "gelslam/core/run_folder.hpp"
#include "gelslam/evaluation/run_and_truth.hpp"
#include "json_file.hpp"

namespace gelslam {
namespace {

using evaluation::detail::integer_at;

/// `report[key]` where it is an object, else an empty one.
nlohmann::json object_at(const nlohmann::json& report, const char* key) {
  const auto found = report.find(key);
  return found != report.end() && found->is_object() ? *found : nlohmann::json::object();
}

/// Of a run of several logs the first one's poses are compared.
void keep_first_log(const nlohmann::json& report, RunResult& run) {
  const nlohmann::json logs = report.value("logs", nlohmann::json::array());
  if (logs.size() < 2 || !logs[1].is_object()) return;
  const nlohmann::json end_s = logs[1].value("first_time_s", nlohmann::json());
  if (!end_s.is_number()) return;
  std::erase_if(run.trajectory, [&](const StampedPose& pose) { return pose.time_s >= end_s.get<double>(); });
  run.log_frames.reset();
}

void read_report(const std::filesystem::path& path, RunResult& run) {
  const nlohmann::json report = evaluation::detail::read_json_object(path);
  run.anchor_frame = integer_at(report, "anchor_frame", 0, path);
  run.trials = integer_at(report, "trials", 0, path);
  run.components = integer_at(report, "components", 0, path);
  const nlohmann::json frames = object_at(report, "frames");
  const bool all_seen = integer_at(frames, "left_out", 0, path).value_or(0) == 0;
  // A run that was interrupted has seen only the beginning of its log.
  if (report.value("partial", nlohmann::json(false)) != true && all_seen) {
    run.log_frames = integer_at(frames, "total", 0, path);
  }
  keep_first_log(report, run);
  if (integer_at(object_at(report, "mesh"), "triangles", 0, path) == 0) run.mesh_path.clear();
}

}  // namespace

RunResult read_run(const std::filesystem::path& folder_or_tum) {
  if (!std::filesystem::exists(folder_or_tum)) {
    throw Error("there is no " + folder_or_tum.string() + ": give a run's folder or a .tum file");
  }
  const bool is_folder = std::filesystem::is_directory(folder_or_tum);
  if (is_folder) check_is_run(folder_or_tum);
  RunResult run;
  run.trajectory = read_tum(is_folder ? folder_or_tum / "trajectory.tum" : folder_or_tum);
  if (run.trajectory.empty()) {
    throw Error("the trajectory of " + folder_or_tum.string() + " is empty: nothing was tracked");
  }
  if (!is_folder) return run;
  if (const auto mesh = folder_or_tum / "mesh.ply"; std::filesystem::exists(mesh)) run.mesh_path = mesh;
  if (const auto report = folder_or_tum / "report.json"; std::filesystem::exists(report))
    read_report(report, run);
  return run;
}

}  // namespace gelslam
