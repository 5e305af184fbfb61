#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <functional>
#include <opencv2/core.hpp>
#include <optional>

#include "gelslam/core/error.hpp"
#include "gelslam/core/folder_update.hpp"
#include "gelslam/core/gradient_model.hpp"
#include "gelslam/core/npy.hpp"
#include "gelslam/core/run_folder.hpp"
#include "gelslam/core/text.hpp"
#include "gelslam/evaluation/run_and_truth.hpp"
#include "gelslam/mesh/mesh_io.hpp"
#include "gelslam/sensor/frame_source.hpp"
#include "gelslam/sensor/raw_log.hpp"
#include "gelslam/slam/config.hpp"
#include "gelslam/slam/session.hpp"
#include "gelslam/slam/slam_map.hpp"
#include "gelslam/surface/slopes.hpp"
#include "info_report.hpp"

namespace gelslam {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::ordered_json;

constexpr std::uintmax_t kLargestJsonBytes = 64u << 20;

/// Runs one part of a folder's inspection; what is wrong with it becomes a problem and the rest goes on.
void attempt(InfoReport& report, const std::function<void()>& part) {
  try {
    part();
  } catch (const Error& error) {
    report.add_problem(error.what());
  }
}

void add_log(InfoReport& report, const fs::path& log, const SensorProfile& profile) {
  const auto source = open_frame_source(log, profile);
  Json value{{"description", source->description()}, {"rate_hz", source->rate_hz()}};
  std::string words = source->description();
  if (const auto frames = source->frame_count()) {
    const double duration_s = static_cast<double>(*frames) / source->rate_hz();
    value["frames"] = *frames;
    value["duration_s"] = duration_s;
    words += fmt::format(", {} frames, {} s", *frames, short_number(duration_s));
  }
  report.add("log", value, words);
  attempt(report, [&] { source->next(); });
}

Config add_config(InfoReport& report, const fs::path& file, const Config& config) {
  const SensorProfile& sensor = config.sensor;
  report.add("config",
             Json{{"file", file.string()},
                  {"device", sensor.device_name},
                  {"width_px", sensor.width_px},
                  {"height_px", sensor.height_px},
                  {"pixel_pitch_mm", sensor.pixel_pitch_mm},
                  {"model", sensor.calibration_model_path.string()}},
             fmt::format("valid; {}, {} pixels of {} mm", sensor.device_name,
                         size_text(sensor.width_px, sensor.height_px), short_number(sensor.pixel_pitch_mm)));
  return config;
}

void add_model(InfoReport& report, const fs::path& file) {
  const GradientModel model = read_gradient_model(file);
  const auto& sizes = model.maker ? MakerNetwork::kSizes : GradientModel::kSizes;
  Json layers = Json::array();
  std::string words = std::to_string(sizes.front());
  for (std::size_t l = 0; l < GradientModel::kLayers; ++l) {
    const int inputs = sizes[l], outputs = sizes[l + 1];
    layers.push_back({{"inputs", inputs}, {"outputs", outputs}});
    words += "-" + std::to_string(outputs);
  }
  const std::size_t weights = model.maker ? model.maker->numbers.size() : model.numbers.size();
  report.add("model", Json{{"file", file.string()}, {"layers", layers}, {"weights", weights}},
             "network " + words + ", " + std::to_string(weights) + " weights, " + file.string());
  const SensorProfile sensor;  // the default grows toward the border of the picture, whatever its size
  double least = 0, most = 0;
  cv::minMaxLoc(uncertainty_of(model, {sensor.width_px, sensor.height_px}, sensor.pixel_pitch_mm).sigma_rad,
                &least, &most);
  const bool is_stated = !model.sigma_rad.empty();
  report.add(
      "slope sigma", Json{{"stated", is_stated}, {"least_rad", least}, {"most_rad", most}},
      fmt::format("{}{:.2f} to {:.2f} rad by place", is_stated ? "" : "not stated; assumed: ", least, most) +
          (is_stated ? "" : ", most at the border"));
}

Config add_config(InfoReport& report, const fs::path& file) {
  return add_config(report, file, read_config(file));
}

std::string shape_text(const std::vector<std::size_t>& shape) {
  std::string text;
  for (const std::size_t extent : shape) text += (text.empty() ? "" : "x") + std::to_string(extent);
  return text.empty() ? "a single number" : text;
}

void add_array(InfoReport& report, const fs::path& file) {
  const NpyArray array = read_npy(file);
  static constexpr const char* type_names[] = {"float32", "float64", "int64", "uint8", "boolean"};
  const std::string type = type_names[static_cast<int>(array.type)];
  report.add("array", Json{{"type", type}, {"shape", array.shape}}, type + ", " + shape_text(array.shape));
}

void add_truth(InfoReport& report, const fs::path& file) {
  const NpyArray array = read_npy(file);
  if (array.shape.size() != 3 || array.shape[1] != 4 || array.shape[2] != 4) {
    throw Error(file.string() + ": holds " + shape_text(array.shape) + " numbers, should hold Nx4x4");
  }
  const std::vector<double> values = array.to_doubles();
  std::size_t touching = 0;
  for (std::size_t i = 0; i < values.size(); i += 16) touching += std::isfinite(values[i]) ? 1u : 0u;
  report.add(
      "truth", Json{{"file", file.filename().string()}, {"poses", array.shape[0]}, {"in_contact", touching}},
      fmt::format("{} poses, {} of them in contact, {}", array.shape[0], touching, file.filename().string()));
}

void add_mesh(InfoReport& report, const fs::path& file) {
  const Mesh mesh = read_mesh(file);
  const bool notes_unit = noted_unit(file).has_value();
  const char* const unit = short_name(unit_of(file));
  Eigen::AlignedBox3f box;
  for (const Eigen::Vector3f& vertex : mesh.vertices_mm) box.extend(vertex);
  const Eigen::Vector3f size = box.isEmpty() ? Eigen::Vector3f::Zero().eval() : box.sizes();
  report.add(
      "mesh",
      Json{{"file", file.string()},
           {"vertices", mesh.vertices_mm.size()},
           {"triangles", mesh.triangles.size()},
           {"size_mm", {size.x(), size.y(), size.z()}},
           {"unit", unit}},
      fmt::format("{} vertices, {} triangles, {} x {} x {} mm; {} {}", mesh.vertices_mm.size(),
                  mesh.triangles.size(), short_number(size.x()), short_number(size.y()),
                  short_number(size.z()), notes_unit ? "its unit is" : "notes no unit; read in", unit));
}

Json read_json_object(const fs::path& file) {
  std::error_code code;
  if (fs::file_size(file, code) > kLargestJsonBytes || code) throw Error(file.string() + ": cannot be read");
  std::ifstream stream(file);
  Json object = Json::parse(stream, nullptr, /*allow_exceptions=*/false);
  if (!object.is_object()) throw Error(file.string() + ": not a JSON object, or truncated");
  return object;
}

/// The report's plain entries; tables and lists (times per stage) are left to those who open the file.
void add_report(InfoReport& report, const fs::path& file) {
  const Json run = read_json_object(file);
  Json value = Json::object();
  std::string words;
  for (const auto& [key, entry] : run.items()) {
    if (entry.is_structured()) continue;
    value[key] = entry;
    words += (words.empty() ? "" : ", ") + key + " " +
             (entry.is_string() ? entry.get<std::string>() : entry.dump());
  }
  report.add("report", value, words);
  if (const auto completeness = read_completeness(file.parent_path());
      completeness && !completeness->complete())
    report.add("missing",
               Json{{"pieces_not_joined", completeness->pieces_not_joined},
                    {"frames_not_in_mesh", completeness->frames_not_in_mesh}},
               describe(*completeness));
  const Json uncertainty = run.value("uncertainty", Json::object());
  const Json description = uncertainty.is_object() ? uncertainty.value("description", Json()) : Json();
  if (description.is_string() && description != "")
    report.add("uncertain", uncertainty, description.get<std::string>());
}

/// What the scan measured; of a run of an older version there is nothing to say.
void add_record(InfoReport& report, const fs::path& folder) {
  const ScanRecord scan = read_scan(folder, {});
  for (const std::string& warning : scan.warnings) report.add_problem(warning);
  const auto keyframes = std::count_if(scan.keyframes.begin(), scan.keyframes.end(),
                                       [](const auto& keyframe) { return keyframe != nullptr; });
  const auto loops = std::count_if(scan.edges.begin(), scan.edges.end(),
                                   [](const PoseGraphEdge& edge) { return edge.kind == EdgeKind::loop; });
  Json parts = Json::array();
  for (const ScanPart& part : scan.parts)
    parts.push_back({{"first_frame", part.first_frame}, {"sensor", part.sensor}, {"log", part.log}});
  report.add(
      "scan",
      Json{{"frames", scan.frames.size()}, {"keyframes", keyframes}, {"loops", loops}, {"parts", parts}},
      fmt::format("{}, {}, {}, {}", counted(std::ssize(scan.frames), "frame"), counted(keyframes, "keyframe"),
                  counted(loops, "loop"), counted(std::ssize(scan.parts), "part")));
}

void add_session(InfoReport& report, const fs::path& folder) {
  std::error_code code;
  if (fs::exists(folder / "scan.jsonl", code)) attempt(report, [&] { add_record(report, folder); });
  if (!fs::exists(folder / "session.json", code)) return report.add_problem(kUnfinishedScan);
  const Session session = load_session(folder);
  for (const std::string& warning : session.warnings) report.add_problem(warning);
  report.add("keyframes", Json{{"in_map", session.patches.size()}},
             counted(std::ssize(session.patches), "keyframe") + " in the map");
}

void add_trajectory(InfoReport& report, const fs::path& file) {
  const std::vector<StampedPose> poses = read_tum(file);
  double length_mm = 0;
  for (std::size_t i = 1; i < poses.size(); ++i)
    length_mm += (poses[i].map_T_sensor.translation() - poses[i - 1].map_T_sensor.translation()).norm();
  const double duration_s = poses.empty() ? 0.0 : poses.back().time_s - poses.front().time_s;
  report.add("trajectory",
             Json{{"poses", poses.size()}, {"duration_s", duration_s}, {"length_mm", length_mm}},
             fmt::format("{} poses over {} s, {} mm long", poses.size(), short_number(duration_s),
                         short_number(length_mm)));
}

InfoReport inspect_surface(const fs::path& folder) {
  InfoReport report(folder, "the surface of one touch (gelslam surface)");
  attempt(report, [&] { add_mesh(report, folder / "surface.ply"); });
  std::error_code code;
  for (const char* name : {"height.png", "normals.png", "contact.png", "curvature.png"})
    if (!fs::exists(folder / name, code)) report.add_problem(std::string("holds no ") + name);
  return report;
}

InfoReport inspect_session(const fs::path& folder) {
  InfoReport report(folder, "the session of a run: what it measured, and its map");
  add_session(report, folder);
  return report;
}

InfoReport inspect_run(const fs::path& folder) {
  InfoReport report(folder, "a run folder");
  attempt(report, [&] { finish_update(folder); });
  if (const std::string left = left_behind(folder); !left.empty()) report.add_problem(left);
  attempt(report, [&] { add_report(report, folder / "report.json"); });
  std::error_code code;
  if (fs::exists(folder / "trajectory.tum", code))
    attempt(report, [&] { add_trajectory(report, folder / "trajectory.tum"); });
  for (const char* name : {"mesh.ply", "config.yaml"}) {
    if (!fs::exists(folder / name, code)) report.add_problem(std::string("holds no ") + name);
  }
  if (fs::exists(folder / "mesh.ply", code)) attempt(report, [&] { add_mesh(report, folder / "mesh.ply"); });
  if (fs::exists(folder / "config.yaml", code))
    attempt(report, [&] { add_config(report, folder / "config.yaml"); });
  if (fs::exists(folder / "session", code)) attempt(report, [&] { add_session(report, folder / "session"); });
  return report;
}

InfoReport inspect_presses(const fs::path& folder) {
  InfoReport report(folder, "calibration presses");
  std::ifstream catalog(folder / "catalog.csv");
  std::string line;
  std::getline(catalog, line);  // heading
  std::size_t presses = 0, missing = 0;
  std::error_code code;
  while (std::getline(catalog, line)) {
    if (line.find(',') == std::string::npos) continue;
    ++presses;
    if (!fs::exists(folder / line.substr(0, line.find(',')) / "gelsight.png", code)) ++missing;
  }
  report.add("presses", Json{{"listed", presses}, {"missing", missing}},
             std::to_string(presses) + " images listed in catalog.csv");
  if (missing > 0) report.add_problem(std::to_string(missing) + " of the listed images are missing");
  if (!fs::exists(folder / "background.png", code)) report.add_problem("holds no background.png");
  return report;
}

InfoReport inspect_data(const fs::path& folder) {
  std::error_code code;
  const bool layout = fs::exists(folder / "config.yaml", code) || fs::exists(folder / "gelsight.avi", code);
  InfoReport report(folder, layout ? "a data folder" : "a folder of images");
  std::optional<Config> config;
  if (fs::exists(folder / "config.yaml", code)) {
    attempt(report, [&] { config = add_config(report, folder / "config.yaml"); });
  }
  const SensorProfile profile = config ? config->sensor : SensorProfile{};
  if (layout) {
    attempt(report, [&] { add_log(report, folder, profile); });
  } else {
    add_log(report, folder, profile);
  }
  if (!profile.calibration_model_path.empty())
    attempt(report, [&] { add_model(report, profile.calibration_model_path); });
  const fs::path truth = truth_file(folder);
  if (fs::exists(truth, code)) attempt(report, [&] { add_truth(report, truth); });
  return report;
}

InfoReport inspect_video(const fs::path& file) {
  InfoReport report(file, "a log");
  const fs::path config = file.parent_path() / "config.yaml";
  SensorProfile profile;
  std::error_code code;
  if (fs::exists(config, code)) attempt(report, [&] { profile = add_config(report, config).sensor; });
  add_log(report, file, profile);
  return report;
}

/// A log that was never closed does not know its length; one that was cut off does not have it. Read to the
/// end.
void add_readable(InfoReport& report, const std::string& key, const fs::path& file,
                  const SensorProfile& profile, ProgressSink& progress) {
  const auto log = open_raw_log(file, profile);
  progress.begin("reading", log->frame_count());
  std::int64_t frames = 0, bytes = 0;
  double duration_s = 0;
  while (const std::optional<RawFrame> frame = log->next()) {
    progress.update(++frames);
    bytes += static_cast<std::int64_t>(frame->bytes.size());
    duration_s = frame->time_s;
  }
  progress.end();
  const std::string state = log->warning().empty() ? "whole" : log->warning();
  report.add(key,
             Json{{"frames", frames},
                  {"duration_s", duration_s},
                  {"lost_by_camera", log->lost_frames()},
                  {"bytes", bytes},
                  {"state", state}},
             fmt::format("{} frames over {} s, {} lost by the camera, {}; {}", frames,
                         short_number(duration_s), log->lost_frames(), bytes_text(bytes), state));
}

InfoReport inspect_recorded_log(const fs::path& file, ProgressSink& progress) {
  const std::vector<fs::path> sensors = sensors_of_log(file);
  InfoReport report(file, sensors.size() > 1 ? "a recorded log of two sensors" : "a recorded log");
  const LogAttachments stored = read_log_attachments(file);
  LogInput input;
  input.log = file;
  SensorProfile profile;
  attempt(report, [&] { profile = add_config(report, file, find_config(input)).sensor; });
  if (!stored.sensor.empty()) report.add("sensor", stored.sensor, stored.sensor);
  if (!stored.camera_settings.empty()) report.add("camera", stored.camera_settings, stored.camera_settings);
  if (!stored.model.empty()) attempt(report, [&] { add_model(report, file); });
  add_log(report, file, profile);
  add_readable(report, "readable", file, profile, progress);
  for (std::size_t i = 1; i < sensors.size(); ++i) {  // all of it: gelslam info both.mkv#2
    const std::string name = "sensor " + std::to_string(i + 1),
                      camera = read_log_attachments(sensors[i]).sensor;
    if (!camera.empty()) report.add(name, camera, camera);
    attempt(report, [&] { add_readable(report, name + " readable", sensors[i], profile, progress); });
  }
  return report;
}

InfoReport inspect_file(const fs::path& file, ProgressSink& progress) {
  const std::string ending = file.extension().string();
  const auto single = [&](const char* kind, const std::function<void(InfoReport&)>& add) {
    InfoReport report(file, kind);
    add(report);
    return report;
  };
  if (ending == ".json" && file.filename() == "session.json") return inspect_session(file.parent_path());
  if (ending == ".json" && file.filename() == "report.json")
    return single("the report of a run", [&](InfoReport& r) { add_report(r, file); });
  if (ending == ".tum") return single("a trajectory", [&](InfoReport& r) { add_trajectory(r, file); });
  if (ending == ".pth" || ending == ".pt" || ending == ".json")
    return single("a gradient model", [&](InfoReport& r) { add_model(r, file); });
  if (ending == ".yaml" || ending == ".yml") {
    return single("a configuration", [&](InfoReport& r) {
      const fs::path model = add_config(r, file).sensor.calibration_model_path;
      if (!model.empty()) attempt(r, [&] { add_model(r, model); });
    });
  }
  if (ending == ".npy") return single("an array", [&](InfoReport& r) { add_array(r, file); });
  if (ending == ".ply" || ending == ".obj" || ending == ".stl") {
    return single("a mesh", [&](InfoReport& r) { add_mesh(r, file); });
  }
  return is_matroska(file) ? inspect_recorded_log(file, progress) : inspect_video(file);
}

}  // namespace

InfoReport inspect(const fs::path& path, ProgressSink& progress) {
  std::error_code code;
  if (!fs::exists(path, code) && !is_matroska(path)) {
    const std::string left = path.empty() ? "" : left_behind(path);
    throw Error(path.string() + ": no such file or folder" + (left.empty() ? "" : "; " + left));
  }
  if (!fs::is_directory(path, code)) return inspect_file(path, progress);
  if (fs::exists(path / "report.json", code)) return inspect_run(path);
  if (fs::exists(path / "session.json", code) || fs::exists(path / "scan.jsonl", code))
    return inspect_session(path);
  if (fs::exists(path / "height_mm.npy", code)) return inspect_surface(path);
  if (fs::exists(path / "catalog.csv", code)) return inspect_presses(path);
  return inspect_data(path);
}

}  // namespace gelslam
