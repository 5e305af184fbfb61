#include <fmt/chrono.h>
#include <fmt/ranges.h>
#include <unistd.h>

#include <algorithm>
#include <fstream>
#include <functional>
#include <iostream>
#include <nlohmann/json.hpp>
#include <optional>

#include "command_line.hpp"
#include "commands.hpp"
#include "gelslam/core/error.hpp"
#include "gelslam/core/npy.hpp"
#include "gelslam/core/run_folder.hpp"
#include "gelslam/core/sensor_optics.hpp"
#include "gelslam/core/text.hpp"
#include "gelslam/evaluation/ground_truth.hpp"
#include "gelslam/exchange/run_export.hpp"
#include "gelslam/localization/maps.hpp"
#include "gelslam/sensor/frame_source.hpp"
#include "gelslam/sensor/raw_log.hpp"
#include "gelslam/slam/config.hpp"
#include "gelslam/slam/store.hpp"
#include "gelslam/slam/surface_stream.hpp"
#include "gelslam/surface/gradient_model.hpp"
#include "terminal_progress.hpp"

namespace gelslam {
namespace {

namespace fs = std::filesystem;

/// Result of `gelslam info` for a file or folder: what it is, whether it is complete, and what can be done
/// with it.
struct InfoReport {
  std::filesystem::path path;
  std::string kind;
  std::vector<std::pair<std::string, std::string>> facts = {};  ///< "log": "320x240, 25 Hz, 245 frames"
  std::vector<std::string> warnings = {};                       ///< What a run lacks.
  std::vector<std::string> problems = {};  ///< Problems that keep other commands from using it.
  std::vector<std::string> commands = {};  ///< Commands that accept it: "export", "track --map".
};

const std::vector<std::string> kTakeLogs = {"reconstruct", "scan", "track", "record --from"},
                               kTakeSessions = {"fuse", "scan --continue", "track --map"};

/// Extensions of files that are written for other programs, or read only as a part of a folder.
constexpr const char* kOnlyWritten[] = {".glb", ".npy", ".html", ".g2o", ".csv"};

/// Runs one part of a folder's inspection. An Error becomes a problem in the report, and the inspection goes
/// on.
void attempt(InfoReport& report, const std::function<void()>& part) {
  try {
    part();
  } catch (const Error& error) {
    if (std::ranges::find(report.problems, error.what()) == report.problems.end())
      report.problems.emplace_back(error.what());
  }
}

void require_files(InfoReport& report, const fs::path& folder, std::initializer_list<const char*> names) {
  std::error_code code;
  for (const char* name : names)
    if (!fs::exists(folder / name, code)) report.problems.push_back(std::string("holds no ") + name);
}

void name_users(InfoReport& report, const std::vector<std::string>& commands) {
  report.commands.insert(report.commands.end(), commands.begin(), commands.end());
}

std::string times_words(std::int64_t unix_us) {
  if (unix_us == 0) return "from 0; it does not say when it was recorded";
  return fmt::format("from {:%Y-%m-%d %H:%M:%S}.{:06} UTC", fmt::gmtime(unix_us / 1'000'000),
                     unix_us % 1'000'000);
}

/// Reads a log to its end, because a log that was not closed does not contain its length, that of a truncated
/// one is wrong, and any image may be damaged.
void add_log(InfoReport& report, const fs::path& log, const SensorProfile& profile, ProgressSink& progress) {
  const auto source = open_frame_source(log, profile);
  std::string words = source->description();
  if (const auto frames = source->frame_count())
    words += fmt::format(", {} frames, {} s", *frames,
                         short_number(static_cast<double>(*frames) / source->rate_hz()));
  report.facts.emplace_back("log", words);
  attempt(report, [&] {
    progress.begin("reading", source->frame_count());
    std::int64_t frames = 0;
    double duration_s = 0;
    while (const std::optional<TactileImage> image = source->next()) {
      if (frames == 0) report.facts.emplace_back("times", times_words(image->unix_us));
      progress.update(++frames);
      duration_s = image->time_s;
    }
    progress.end();
    const std::string warning = source->warning();
    report.facts.emplace_back("readable", fmt::format("{} frames over {} s, {} lost by the camera{}", frames,
                                                      short_number(duration_s), source->lost_frames(),
                                                      warning.empty() ? "; whole" : ""));
    if (!warning.empty()) report.problems.push_back(warning);
    if (frames > 0) name_users(report, kTakeLogs);
  });
}

SensorProfile add_config(InfoReport& report, const Config& config) {
  const SensorProfile& sensor = config.sensor;
  report.facts.emplace_back("config", fmt::format("valid; {}, {} pixels of {} mm", sensor.device_name,
                                                  size_text(sensor.width_px, sensor.height_px),
                                                  short_number(sensor.pixel_pitch_mm)));
  report.facts.emplace_back("optics", optics_text(config.surface.optics) + ", from: " + config.optics_from);
  return sensor;
}

void add_model(InfoReport& report, const fs::path& file) {
  const GradientModel model = read_gradient_model(file);
  const std::size_t weights = model.wide ? model.wide->numbers.size() : model.numbers.size();
  report.facts.emplace_back("model", fmt::format("network of {} weights, {}", weights, file.string()));
  if (model.optics) report.facts.emplace_back("made for", optics_text(*model.optics));
}

void add_mesh(InfoReport& report, const fs::path& file, const Mesh& mesh) {
  Eigen::AlignedBox3f box;
  for (const Eigen::Vector3f& vertex : mesh.vertices_mm) box.extend(vertex);
  const Eigen::Vector3f size = box.isEmpty() ? Eigen::Vector3f::Zero().eval() : box.sizes();
  report.facts.emplace_back(
      "mesh", fmt::format("{} vertices, {} triangles, {} x {} x {} mm; {} {}", mesh.vertices_mm.size(),
                          mesh.triangles.size(), short_number(size.x()), short_number(size.y()),
                          short_number(size.z()), noted_unit(file) ? "its unit is" : "notes no unit; read in",
                          short_name(unit_of(file))));
}

void add_session(InfoReport& report, const fs::path& run) {
  attempt(report, [&] {
    const std::optional<MapSnapshot> session = find_saved_map(run);
    if (!session) refuse_unfinished(run);
    if (!session->warning.empty()) report.problems.push_back(session->warning);
    if (fs::exists(run / "report.json")) read_scan(run, {});
    report.facts.emplace_back("session", counted(std::ssize(session->nodes), "keyframe") + " in the map");
    name_users(report, kTakeSessions);
  });
}

/// Checks what `reconstruct` would refuse: most often a log that does not begin with the bare gel.
void check_beginning(InfoReport& report, const LogInput& input) {
  attempt(report, [&] {
    StageTimer timer;
    SurfaceStream(input, resolve_config(input), timer);
  });
}

InfoReport inspect_surface(const fs::path& folder) {
  InfoReport report{folder, "the surface of one touch (gelslam surface)"};
  attempt(report, [&] {
    add_mesh(report, folder / "surface.ply", read_mesh(folder / "surface.ply"));
    name_users(report, {"view"});
  });
  require_files(report, folder, {"height.png", "normals.png", "contact.png", "curvature.png"});
  return report;
}

InfoReport inspect_session(const fs::path& file) {
  InfoReport report{file, "the session of a run: what it measured, and its map"};
  add_session(report, file.parent_path());
  return report;
}

InfoReport inspect_map(const fs::path& folder) {
  InfoReport report{folder, "a map of a mesh (gelslam map)"};
  attempt(report, [&] {
    add_mesh(report, folder / "mesh.ply", read_mesh(folder / "mesh.ply"));
    report.facts.emplace_back("touches", std::to_string(read_map(folder).nodes.size()));
    name_users(report, {"track --map", "view", "export"});
  });
  return report;
}

InfoReport inspect_run(const fs::path& folder) {
  check_run_files(folder);
  InfoReport report{folder, "a run folder"};
  attempt(report, [&] {
    const RunContents run = read_run_contents(folder);
    for (const auto& [name, words] : run.figures) report.facts.emplace_back(lower_case(name), words);
    report.warnings = run.warnings;
    if (!fs::exists(folder / "mesh.ply")) return;
    add_mesh(report, folder / "mesh.ply", run.mesh);
    if (!run.mesh.triangles.empty()) name_users(report, {"view", "export"});
    name_users(report, {"evaluate"});
  });
  if (const std::string left = left_behind(folder); !left.empty()) report.warnings.push_back(left);
  require_files(report, folder, {"mesh.ply", "config.yaml"});
  if (fs::exists(folder / "config.yaml"))
    attempt(report, [&] { add_config(report, read_config(folder / "config.yaml")); });
  if (has_session(folder)) add_session(report, folder);
  return report;
}

InfoReport inspect_presses(const fs::path& folder) {
  InfoReport report{folder, "calibration presses"};
  std::ifstream catalog(folder / "catalog.csv");
  std::string line;
  std::getline(catalog, line);  // Skips the heading.
  std::size_t presses = 0, missing = 0;
  std::error_code code;
  while (std::getline(catalog, line)) {
    const std::size_t end = line.find_first_of(",;");
    if (end == std::string::npos) continue;
    ++presses;
    if (!fs::exists(folder / line.substr(0, end) / "gelsight.png", code)) ++missing;
  }
  report.facts.emplace_back("presses", std::to_string(presses) + " images listed in catalog.csv");
  if (missing > 0) report.problems.push_back(std::to_string(missing) + " of the listed images are missing");
  require_files(report, folder, {"background.png"});
  name_users(report, {"calibrate collect", "calibrate train", "calibrate check"});
  return report;
}

/// Inspects a recorded log, a data folder, a folder of images, or a video.
InfoReport inspect_log(const fs::path& log, int track, ProgressSink& progress) {
  std::error_code code;
  const bool is_folder = fs::is_directory(log, code);
  const fs::path folder = is_folder ? log : log.parent_path(), config = folder / "config.yaml",
                 truth = truth_file(folder);
  const bool is_recorded = !is_folder && is_matroska(log);
  const bool is_data = is_folder && (fs::exists(config, code) || fs::exists(folder / "gelsight.avi", code));
  InfoReport report{log, is_recorded ? "a recorded log"
                         : is_data   ? "a data folder"
                         : is_folder ? "a folder of images"
                                     : "a log"};
  SensorProfile profile;
  if (is_recorded || fs::exists(config, code))
    attempt(report, [&] { profile = add_config(report, find_config({.log = log})); });
  if (track > 0) profile.video_track = track;
  const auto add = [&] { add_log(report, log, profile, progress); };
  is_data ? attempt(report, add) : add();
  if (!profile.calibration_model_path.empty()) {
    attempt(report, [&] { add_model(report, profile.calibration_model_path); });
    check_beginning(report, {.log = log, .track = track});
  }
  if (is_folder && fs::exists(truth, code))
    attempt(report, [&] {
      read_npy(truth);
      name_users(report, {"evaluate"});
    });
  return report;
}

InfoReport inspect_file(const fs::path& file, int track, ProgressSink& progress) {
  const std::string ending = file.extension().string(), name = file.filename().string();
  const fs::path folder = fs::absolute(file).parent_path();
  std::error_code code;
  if (name == "map.json" || (name == "session.db" && fs::exists(folder / "map.json", code)))
    return inspect_map(folder);
  if (name == "session.db") return inspect_session(fs::absolute(file));
  if (name == "report.json") return inspect_run(folder);
  if (name == "catalog.csv") return inspect_presses(folder);
  InfoReport report{file, ""};
  // Extensions used by motion capture systems and other programs.
  if (ending == ".tum" || ending == ".txt") {
    report.kind = "a trajectory";
    report.facts.emplace_back("poses", std::to_string(read_tum(file).size()));
    report.commands = {"evaluate"};
  } else if (ending == ".pth" || ending == ".pt" || ending == ".json") {
    report.kind = "a gradient model";
    add_model(report, file);
    report.commands = {"reconstruct --model", "scan --model"};
  } else if (name == kOpticsFileName || (ending == ".yaml" && read_file(file).starts_with("lens_k1:"))) {
    report.kind = "the optics of a sensor's camera, for the log, model or catalog.csv beside it";
    report.facts.emplace_back("optics", optics_text(read_optics(file)));
    report.commands = {"simulate scan --optics"};
  } else if (ending == ".yaml" || ending == ".yml") {
    report.kind = "a configuration";
    const fs::path model = add_config(report, find_config({.config = file})).calibration_model_path;
    if (!model.empty()) attempt(report, [&] { add_model(report, model); });
    report.commands = {"reconstruct --config", "scan --config"};
  } else if (ending == ".ply" || ending == ".obj" || ending == ".stl") {
    report.kind = "a mesh";
    add_mesh(report, file, read_mesh(file));
    report.commands = {"view", "export", "map", "evaluate", "simulate scan --object"};
  } else if (std::ranges::find(kOnlyWritten, ending) != std::end(kOnlyWritten)) {
    throw Error(file.string() +
                ": written for other programs, or part of a folder; give the run or folder that it is of");
  } else {
    return inspect_log(file, track, progress);
  }
  return report;
}

/// Throws Error when `path` is no file or folder of this program or, for a single file, when it is damaged. A
/// damaged part of a folder becomes a problem in the report.
InfoReport inspect(const fs::path& path, int track, ProgressSink& progress) {
  std::error_code code;
  if (!fs::exists(path, code) && !is_matroska(path)) {
    const std::string left = path.empty() ? "" : left_behind(path);
    throw Error(path.string() + ": no such file or folder" + (left.empty() ? "" : "; " + left));
  }
  if (!fs::is_directory(path, code)) return inspect_file(path, track, progress);
  if (fs::exists(path / "report.json", code)) return inspect_run(path);
  if (fs::exists(path / "map.json", code)) return inspect_map(path);
  if (fs::exists(path / "session.db", code)) return inspect_session(path / "session.db");
  if (fs::exists(path / "height_mm.npy", code)) return inspect_surface(path);
  if (fs::exists(path / "catalog.csv", code)) return inspect_presses(path);
  return inspect_log(path, track, progress);
}

std::string info_text(const InfoReport& report) {
  std::string text = one_line(report.path.string()) + ": " + report.kind + "\n";
  const auto line = [&](const std::string& key, const std::string& words) {
    text += fmt::format("  {:<11}{}\n", key, words);
  };
  for (const auto& [key, words] : report.facts) line(key, one_line(words));
  for (const std::string& warning : report.warnings) line("warning", amber(one_line(warning), STDOUT_FILENO));
  for (const std::string& problem : report.problems) line("problem", terminal_line(problem));
  if (!report.commands.empty()) line("use", fmt::format("gelslam {}", fmt::join(report.commands, ", ")));
  return text;
}

std::string info_json(const InfoReport& report) {
  using Json = nlohmann::ordered_json;
  Json object{{"path", report.path.string()}, {"kind", report.kind}};
  for (const auto& [key, words] : report.facts) object[key] = words;
  object["warnings"] = report.warnings;
  object["problems"] = report.problems;
  object["use"] = report.commands;
  // File names may contain any bytes; those that are not UTF-8 are replaced.
  return object.dump(2, ' ', false, Json::error_handler_t::replace) + "\n";
}

struct InfoArguments {
  std::filesystem::path path;
  int track = 0;
  bool json = false, quiet = false;
};

int run_info(const InfoArguments& arguments) {
  const InfoReport report = inspect(arguments.path, arguments.track, *make_progress(arguments.quiet));
  std::cout << (arguments.json ? info_json(report) : info_text(report));
  return report.problems.empty() ? kExitDone : kExitNotGood;
}

}  // namespace

void add_info_command(CLI::App& app, int& exit_code) {
  CLI::App* command =
      app.add_subcommand("info", "Say what a file or folder is, whether it is whole, and what takes it");
  auto& arguments = options_of(*command, exit_code, run_info);
  command
      ->add_option("PATH", arguments.path,
                   "Log, video, folder of images, data folder, run, session, trajectory, surface folder, "
                   "calibration presses, model, configuration or mesh")
      ->required();
  command->add_flag("--json", arguments.json, "Print one JSON object for another program");
  add_track_option(*command, arguments.track);
  add_quiet_flag(*command, arguments.quiet);
  command->footer(
      "Example: gelslam info RUN --json\nExit code 1: something is wrong with it; the output says what.");
}

}  // namespace gelslam
