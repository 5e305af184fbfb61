#include <algorithm>
#include <chrono>

#include "gelslam/core/error.hpp"
#include "gelslam/core/files.hpp"
#include "gelslam/core/run_folder.hpp"
#include "gelslam/mesh/mesh_io.hpp"
#include "gelslam/slam/merge_scans.hpp"
#include "gelslam/slam/store.hpp"
#include "run_folder/run_writer.hpp"

namespace gelslam {
namespace {

namespace fs = std::filesystem;

Config config_of(const FuseRequest& request) {
  Config config = read_config(request.run / "config.yaml");
  FusionOptions& fusion = config.slam.fusion;
  if (request.voxel_size_mm) fusion.voxel_size_mm = *request.voxel_size_mm;
  fusion.truncation_mm =
      request.truncation_mm.value_or(std::max(fusion.truncation_mm, 2 * fusion.voxel_size_mm));
  // Checked here, before the session is read, which takes time.
  if (fusion.truncation_mm < 2 * fusion.voxel_size_mm)
    throw Error("the truncation has to be at least twice the voxel size; give the truncation, too");
  try {
    return read_config_text(write_config(config), "");  // Checks that the values are within their bounds.
  } catch (const Error& error) {
    const std::string text = error.what(), section = "fusion_config.";
    const std::size_t at = text.find(section);
    throw Error(at == std::string::npos ? text : text.substr(at + section.size()));
  }
}

/// Writes the mesh and the files that depend on the fusion options.
void write_fused(const fs::path& folder, const Config& config, const Mesh& mesh,
                 const std::optional<RunReport>& report) {
  write_mesh(folder / "mesh.ply", mesh);
  write_file_atomically(folder / "config.yaml", write_config(config));
  if (report) write_file_atomically(folder / "report.json", report_json(*report));
}

/// Copies the files of a run, except the logs, which are large, and files that do not belong to a run.
void copy_run(const fs::path& from, const fs::path& to) {
  for (const char* entry :
       {"trajectory.tum", "covariances.npy", "keyframes.tum", "pose_graph.g2o", "loop_outliers.g2o"}) {
    std::error_code code;
    if (!fs::exists(from / entry, code)) continue;
    fs::copy(from / entry, to / entry, code);
    if (code) throw Error((to / entry).string() + ": cannot be written: " + code.message());
  }
  copy_store(from, to);
}

/// Where the results are written: the run itself, which is then locked, or another folder.
struct Target {
  explicit Target(const FuseRequest& request) {
    if (request.output.empty())
      lock = FolderLock(request.run);
    else
      folder.emplace(request.output,
                     RunFolderOptions{.overwrite = request.overwrite, .inputs = {request.run}});
  }
  FolderLock lock;
  std::optional<RunFolder> folder;
};

/// Makes map and mesh for a scan that was killed before its map was saved, or that was continued afterwards.
FuseSummary finish_killed(const FuseRequest& request, const Config& config, Target& target,
                          ProgressSink& progress, const std::function<bool()>& stop_requested) {
  const auto start = std::chrono::steady_clock::now();
  const ScanRecord record = read_scan(request.run, config.slam.registration);
  if (std::ranges::all_of(record.keyframes, [](const auto& keyframe) { return keyframe == nullptr; }))
    throw Error(request.run.string() + ": holds no keyframe to fuse");
  StageTimer timer;
  Run run = finish_scan(config, record, "the session of a scan that was not finished", timer, start, progress,
                        stop_requested);
  if (stop_requested()) throw Error("stopped; nothing was changed");
  if (target.folder) {
    write_run(target.folder->path(), run);
    target.folder->commit();
  } else {
    replace_results(
        request.run, [&](const fs::path& folder) { write_results(folder, run); }, &run.map);
  }
  const auto in_map = std::count(run.map.in_map.begin(), run.map.in_map.end(), true);
  return {static_cast<std::size_t>(in_map), run.report.mesh, run.report.touched, true};
}

}  // namespace

FuseSummary fuse_run(const FuseRequest& request, ProgressSink& progress,
                     const std::function<bool()>& stop_requested) {
  check_is_run(request.run, RunNeeds::record);
  Config config = config_of(request);
  if (request.keep_all) config.slam.fusion.min_shell_mm2 = 0;
  Target target(request);
  const std::optional<MapSnapshot> session = find_saved_map(request.run);
  if (!session || !session->warning.empty() || is_unfinished(request.run))
    return finish_killed(request, config, target, progress, stop_requested);
  if (session->nodes.empty()) throw Error(request.run.string() + ": holds no keyframe to fuse");
  RunReport::MeshSize size;
  const Mesh mesh = fuse(posed_surfaces(*session), config.slam.fusion, session->gradient_scale.mean(),
                         &progress, &size.islands_left_out);
  size.vertices = mesh.vertices_mm.size();
  size.triangles = mesh.triangles.size();
  std::optional<RunReport> report = find_report(request.run);
  if (report) {
    report->mesh = size;
    report->touched.in_mesh_cm2 = touched_surface(*session, mesh, config.slam.fusion.threads).in_mesh_cm2;
  }
  if (stop_requested()) throw Error("stopped; nothing was changed");
  const auto write = [&](const fs::path& folder) { write_fused(folder, config, mesh, report); };
  if (target.folder) {
    copy_run(request.run, target.folder->path());
    write(target.folder->path());
    target.folder->commit();
  } else {
    replace_results(request.run, write, nullptr);
  }
  return {session->nodes.size(), size, report.value_or(RunReport()).touched, false};
}

}  // namespace gelslam
