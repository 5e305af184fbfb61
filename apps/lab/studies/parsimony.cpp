// Study: what is spent, and what it buys. Whole reconstructions with one setting away from its default:
// keyframes, samples, pixels that the gradient model sees, triangles, bytes, against the errors of trajectory
// and mesh.

#include <fmt/core.h>

#include <algorithm>
#include <filesystem>
#include <functional>
#include <opencv2/core.hpp>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "gelslam/core/files.hpp"
#include "gelslam/core/progress.hpp"
#include "gelslam/evaluation/evaluation.hpp"
#include "gelslam/slam/reconstruct.hpp"
#include "gelslam/slam/surface_stream.hpp"
#include "registration_problems.hpp"
#include "study.hpp"

namespace gelslam::lab {
namespace {

namespace fs = std::filesystem;

struct ParsimonyArguments {
  std::vector<fs::path> data;
  std::vector<std::string> knobs;  // empty: all
  bool quick = false;
  fs::path out;
};

constexpr const char* kDefault = "default";

/// One knob of the configuration, turned.
struct Setting {
  std::string knob, value;
  std::function<void(Config&)> turn;
};

template <class Value, class Turn>
void add_settings(std::vector<Setting>& settings, const char* knob, const std::vector<Value>& values,
                  const Turn& turn) {
  for (const Value value : values)
    settings.push_back({knob, fmt::format("{:g}", static_cast<double>(value)),
                        [turn, value](Config& config) { turn(config, value); }});
}

std::vector<Setting> all_settings() {
  std::vector<Setting> settings = {{kDefault, "", [](Config&) {}}};
  add_settings<double>(settings, "keyframe_min_shared", {0.2, 0.4, 0.7, 0.85},
                       [](Config& c, double v) { c.slam.tracker.keyframe_min_shared = v; });
  add_settings<int>(settings, "max_samples", {100, 300, 1000, 2000, 5000, 20000},
                    [](Config& c, int v) { c.slam.registration.max_samples = v; });
  settings.push_back({"gradient_everywhere", "", [](Config& c) { c.surface.gradient_everywhere = true; }});
  add_settings<double>(settings, "voxel_size_mm", {0.05, 0.12, 0.2, 0.3},
                       [](Config& c, double v) { c.slam.fusion.voxel_size_mm = v; });
  return settings;
}

/// What of all was asked for: the default, and of each knob in turn all settings or two.
std::vector<Setting> chosen_settings(const ParsimonyArguments& arguments) {
  std::vector<Setting> chosen;
  for (const Setting& setting : all_settings()) {
    const auto& knobs = arguments.knobs;
    const bool wanted = setting.knob == kDefault || knobs.empty() ||
                        std::find(knobs.begin(), knobs.end(), setting.knob) != knobs.end();
    const auto before = std::count_if(chosen.begin(), chosen.end(),
                                      [&](const Setting& other) { return other.knob == setting.knob; });
    if (wanted && !(arguments.quick && before >= 2)) chosen.push_back(setting);
  }
  return chosen;
}

std::set<std::string> knob_names() {
  std::set<std::string> names;
  for (const Setting& setting : all_settings())
    if (setting.knob != kDefault) names.insert(setting.knob);
  return names;
}

/// Mean number of pixels per frame that changed, so that the network sees them: elsewhere the gel is taken to
/// be exactly flat. From every tenth frame.
double changed_pixels(const LogInput& input) {
  const Config config = resolve_config(input);
  StageTimer timer;
  SurfaceStream stream(input, config, timer);
  const cv::Scalar flat(0, 0, 1);
  double pixels = 0, frames = 0;
  while (const std::optional<SurfaceStream::Item> item = stream.next()) {
    if (!item->surface || item->frame % 10 != 0) continue;
    cv::Mat1b same;
    cv::inRange(item->surface->normals, flat, flat, same);
    pixels += static_cast<double>(same.total()) - cv::countNonZero(same);
    ++frames;
  }
  return frames > 0 ? pixels / frames : 0;
}

std::uintmax_t bytes_in(const fs::path& folder) {
  std::uintmax_t bytes = 0;
  for (const auto& entry : fs::recursive_directory_iterator(folder))
    if (entry.is_regular_file()) bytes += entry.file_size();
  return bytes;
}

/// The row's errors; those of the mesh are null where there is no true one.
void add_errors(Json& row, const fs::path& run, const fs::path& folder) {
  const Comparison comparison = compare(run, folder);
  const Evaluation evaluation = evaluate(comparison, std::nullopt);
  row["error_mm"] = evaluation.trajectory->geometric_mean_mm;
  row["ate_mm"] = evaluation.trajectory->ate_mm;
  row["tracked_share"] = evaluation.trajectory->tracked_share();
  row["mesh_mean_mm"] = row["mesh_completeness"] = nullptr;
  const std::optional<PlacedMeshes> meshes = place_meshes(comparison);
  if (!meshes) return;
  const MeshMetrics metrics = evaluate_mesh(TriangleScene(meshes->estimate), TriangleScene(meshes->truth),
                                            comparison.truth.touched_mm);
  row["mesh_mean_mm"] = metrics.accuracy.mean_mm;
  for (const ShareWithin& share : metrics.within)
    if (share.distance_mm == 0.1) row["mesh_completeness"] = share.completeness;
}

Json measure(const fs::path& folder, const Setting& setting, double changed, const fs::path& run) {
  ReconstructRequest request;
  request.input.log = folder;
  request.config = resolve_config(request.input);
  setting.turn(request.config);
  request.run_folder = run;
  request.overwrite = true;
  NoProgress progress;
  const RunReport report = reconstruct(request, progress, [] { return false; }).report;
  Json row = {{"sequence", name_of(folder)}, {"knob", setting.knob}, {"value", setting.value}};
  row["keyframes"] = report.keyframes;
  row["samples"] = request.config.slam.registration.max_samples;
  const SensorProfile& sensor = request.config.sensor;
  row["pixels"] =
      request.config.surface.gradient_everywhere ? 1.0 * sensor.width_px * sensor.height_px : changed;
  row["triangles"] = report.mesh.triangles;
  row["bytes"] = bytes_in(run);
  row["components"] = report.components;
  add_errors(row, run, folder);
  return row;
}

void run(const ParsimonyArguments& chosen) {
  ParsimonyArguments arguments = chosen;
  if (arguments.data.empty())
    arguments.data = sequence_folders({"track_peanut", "hard_breaks", "scan_peanut360"});
  const std::vector<Setting> settings = chosen_settings(arguments);
  Json rows = Json::array();
  const fs::path last_run = arguments.out / "last_run";
  StudyCases cases(arguments.data.size() * settings.size());
  for (const fs::path& folder : arguments.data) {
    const double changed = changed_pixels({folder, {}, {}, {}, false});
    for (const Setting& setting : settings) {
      cases.begin(name_of(folder) + " " + setting.knob + " " + setting.value);
      rows.push_back(measure(folder, setting, changed, last_run));
      write_study(arguments.out, "parsimony", rows);
    }
  }
  fs::remove_all(last_run);
  print_table(rows);
}

}  // namespace

void add_parsimony(CLI::App& lab) {
  const auto arguments = std::make_shared<ParsimonyArguments>();
  CLI::App* command =
      add_study(lab, "parsimony",
                "Measure errors of trajectory and mesh against keyframes, samples, pixels and triangles",
                arguments, run);
  command->add_option("DATA", arguments->data,
                      "Data folders with truth (default: track_peanut, hard_breaks and scan_peanut360 of "
                      "GELSLAM_DATA/sequences)");
  add_list(*command, "--knobs", arguments->knobs, "Only these keys of the configuration (default: all)")
      ->check(CLI::IsMember(knob_names()));
  command->add_flag("--quick", arguments->quick, "Two settings per knob");
  command->add_option("-o,--output", arguments->out, "Folder for parsimony.csv and .json")->required();
  command->footer("Example: gelslam-lab parsimony --quick -o STUDY && scripts/plot_parsimony.py STUDY");
}

}  // namespace gelslam::lab
