#include <fmt/core.h>

#include <algorithm>
#include <cmath>

#include "gelslam/core/error.hpp"
#include "gelslam/core/median.hpp"
#include "gelslam/core/text.hpp"
#include "gelslam/exchange/run_export.hpp"
#include "gelslam/image/color_map.hpp"

namespace gelslam {
namespace {

namespace fs = std::filesystem;

void add_figures(RunContents& run, const RunReport& report) {
  const RunReport::Frames& frames = report.frames;
  const std::string contradicted =
      report.loop_outliers > 0 ? fmt::format(", {} contradicted", report.loop_outliers) : "";
  run.figures = {
      {"Frames", fmt::format("{} of {} tracked, {} in the map", frames.tracked, frames.total, frames.in_map)},
      {"Components", counted(report.trials, "trial") + " in " + counted(report.components, "component")},
      {"Keyframes", std::to_string(report.keyframes)},
      {"Loops", std::to_string(report.loops) + contradicted}};
  if (const std::string touched = describe(report.touched); !touched.empty())
    run.figures.emplace_back("Surface", touched);
  if (!report.log_description.empty()) run.figures.emplace_back("Log", report.log_description);
}

void add_path(RunContents& run) {
  if (run.trajectory.empty()) return;
  double length_mm = 0;
  for (std::size_t i = 1; i < run.trajectory.size(); ++i)
    length_mm +=
        (run.trajectory[i].map_T_sensor.translation() - run.trajectory[i - 1].map_T_sensor.translation())
            .norm();
  const double duration_s = run.trajectory.back().time_s - run.trajectory.front().time_s;
  run.figures.emplace_back("Motion", fmt::format("{} mm in {}", short_number(length_mm),
                                                 duration_s < 10 ? short_number(duration_s, 2) + " s"
                                                                 : duration_text(duration_s)));
}

/// Removes the folders of logs from a text, because a page may be sent to other people.
void leave_out_folders(std::string& text, const std::vector<RunReport::Log>& logs) {
  for (const RunReport::Log& log : logs)
    if (const std::size_t at = log.file.empty() ? std::string::npos : text.find(log.file); at != text.npos)
      text.replace(at, log.file.size(), fs::path(log.file).filename().string());
}

/// Returns the path of a log. That of a live scan is in the run's folder, which may have been moved.
fs::path find_log(const fs::path& folder, const fs::path& named) {
  std::error_code code;
  const fs::path own = folder / (named.extension() == ".mkv" ? named.filename() : "log.mkv");
  return fs::exists(own, code) && !fs::exists(named, code) ? own : named;
}

void add_report(RunContents& run) {
  const RunReport& report = *run.report;
  add_figures(run, report);
  run.warnings = report.warnings;
  if (report.partial) run.warnings.emplace_back("The run ended before its log did.");
  run.warnings.insert(run.warnings.end(), report.result_warnings.begin(), report.result_warnings.end());
  run.logs = report.logs;
  if (run.logs.empty()) run.logs.push_back({report.log, run.start_s()});
  for (auto& [name, words] : run.figures) leave_out_folders(words, run.logs);
  for (std::string& warning : run.warnings) leave_out_folders(warning, run.logs);
  for (RunReport::Log& log : run.logs) log.file = find_log(run.folder, log.file).string();
}

RunContents read_folder(const fs::path& folder) {
  RunContents run;
  static_cast<RunFiles&>(run) = read_run_files(folder);
  run.name = fs::weakly_canonical(folder).filename().string();
  if (const fs::path file = run.mesh_file(); !file.empty()) run.mesh = read_mesh(file);
  if (run.report)
    add_report(run);
  else
    run.warnings.emplace_back("There is no report.json.");
  run.logs.resize(std::max<std::size_t>(run.logs.size(), 1));
  add_path(run);
  return run;
}

std::vector<float> values_of(const Mesh& mesh, MeshColor color) {
  if (color == MeshColor::confidence) {
    if (mesh.confidence.size() != mesh.vertices_mm.size() || mesh.confidence.empty())
      throw Error(
          "the mesh has no confidence to color it by (only this program's PLY has); use --color height");
    return mesh.confidence;
  }
  std::vector<float> heights_mm;
  for (const Eigen::Vector3f& v : mesh.vertices_mm) heights_mm.push_back(-v.z());
  return heights_mm;
}

/// Returns the values at both ends of the color map.
std::pair<float, float> range_of(std::vector<float> values, MeshColor color) {
  if (values.empty()) return {0.0F, 1.0F};
  if (color == MeshColor::height) {
    const auto [low, high] = std::minmax_element(values.begin(), values.end());
    return {*low, std::max(*high, *low + 1e-6F)};
  }
  return {0.0F, std::max(quantile_in_place(values, 0.95), 1e-3F)};
}

}  // namespace

RunContents read_run_contents(const fs::path& run_or_mesh) {
  std::error_code code;
  if (!fs::exists(run_or_mesh, code)) throw Error(run_or_mesh.string() + ": no such file or folder");
  if (fs::is_directory(run_or_mesh)) return read_folder(run_or_mesh);
  RunContents run;
  run.name = run_or_mesh.filename().string();
  run.mesh = read_mesh(run_or_mesh);
  return run;
}

VertexColors vertex_colors(const Mesh& mesh, MeshColor color) {
  if (color == MeshColor::none) return {};
  const std::vector<float> values = values_of(mesh, color);
  const auto [low, high] = range_of(values, color);
  const auto map = color_map_rgb(color == MeshColor::height ? ColorMap::height : ColorMap::confidence);
  VertexColors colors;
  for (const float value : values) {
    const float share = std::clamp((value - low) / (high - low), 0.0F, 1.0F);
    colors.push_back(map[static_cast<std::size_t>(std::lround(share * 255))]);
  }
  return colors;
}

}  // namespace gelslam
