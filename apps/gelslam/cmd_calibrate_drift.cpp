#include <algorithm>
#include <array>
#include <iostream>
#include <memory>
#include <nlohmann/json.hpp>
#include <vector>

#include "calibrate_commands.hpp"
#include "commands.hpp"
#include "gelslam/calibration/background_drift.hpp"
#include "gelslam/core/error.hpp"
#include "gelslam/sensor/frame_source.hpp"
#include "gelslam/sensor/image_input.hpp"
#include "gelslam/slam/config.hpp"
#include "gelslam/surface/background.hpp"
#include "gelslam/surface/model_file.hpp"
#include "terminal_progress.hpp"

namespace gelslam {
namespace {

namespace fs = std::filesystem;

struct DriftArguments {
  fs::path now, model, background, config;
  bool json = false, quiet = false;
};

bool is_picture(const fs::path& path) {
  constexpr std::array<const char*, 6> endings = {".png", ".jpg", ".jpeg", ".bmp", ".tif", ".tiff"};
  const std::string ending = path.extension().string();
  return std::any_of(endings.begin(), endings.end(), [&](const char* known) { return ending == known; });
}

cv::Mat3b read_bare_gel(const fs::path& path, const Config& config) {
  if (is_picture(path))
    return MarkerFiller(fit_to_profile(read_image(path), config.sensor, "'" + path.string() + "'"))
        .background();
  const std::unique_ptr<FrameSource> source = open_frame_source(path, config.sensor);
  std::vector<cv::Mat3b> frames;
  while (static_cast<int>(frames.size()) < config.background_frames) {
    const auto frame = source->next();
    if (!frame) break;
    frames.push_back(frame->bgr.clone());
  }
  if (frames.empty()) throw Error("'" + path.string() + "' holds no frames");
  return MarkerFiller(mean_image(frames)).background();
}

cv::Mat3f cells_then(const DriftArguments& arguments, const Config& config) {
  if (!arguments.background.empty()) return background_cells(read_bare_gel(arguments.background, config));
  if (arguments.model.empty()) throw Error("compare with what? give --model or --background");
  const ModelFile file = read_model_file(arguments.model);
  if (!file.record)
    throw Error(
        "'" + arguments.model.string() +
        "' does not say how its background looked (only models that gelslam calibrate wrote do); give "
        "--background");
  return file.record->background_cells;
}

int run_drift(const DriftArguments& arguments) {
  const Config config = arguments.config.empty() ? Config{} : read_config(arguments.config);
  const cv::Mat3f then = cells_then(arguments, config);
  const BackgroundDrift drift = measure_drift(then, background_cells(read_bare_gel(arguments.now, config)));
  if (arguments.json)
    std::cout << nlohmann::ordered_json{{"gel_changed", drift.gel_changed},
                                        {"light_changed", drift.light_changed},
                                        {"gel_change_levels", drift.gel_change_levels},
                                        {"worst_cell_levels", drift.worst_cell_levels},
                                        {"worst_cell", {drift.worst_cell.x, drift.worst_cell.y}},
                                        {"light_change_levels", drift.light_change_levels},
                                        {"light_gain_bgr", drift.light_gain},
                                        {"light_offset_bgr", drift.light_offset},
                                        {"words", drift.words}}
                     .dump(1)
              << "\n";
  else
    std::cout << drift.words << "\n";
  return drift.gel_changed || drift.light_changed ? kExitNotGood : kExitDone;
}

}  // namespace

void add_calibrate_drift_command(CLI::App& calibrate, int& exit_code) {
  CLI::App* command = calibrate.add_subcommand(
      "drift", "Check whether the gel or the light has changed since the calibration");
  const auto arguments = std::make_shared<DriftArguments>();
  command->add_option("LOG", arguments->now, "Log that begins with the bare gel, or a picture of it")
      ->required();
  command->add_option("--model", arguments->model, "A model that gelslam calibrate wrote");
  command->add_option("--background", arguments->background,
                      "Background (picture or log) of the calibration, instead of a model");
  command->add_option("--config", arguments->config, "The sensor's configuration");
  command->add_flag("--json", arguments->json, "Print one JSON object for another program");
  add_quiet_flag(*command, arguments->quiet);  // there is only the result
  command->footer(
      "Exit code 1: something has changed.\n"
      "Example: gelslam calibrate drift today.mkv --model model.json");
  command->callback([arguments, &exit_code] { exit_code = run_drift(*arguments); });
}

}  // namespace gelslam
