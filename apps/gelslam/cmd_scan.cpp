#include <array>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "camera_input.hpp"
#include "commands.hpp"
#include "gelslam/core/error.hpp"
#include "gelslam/slam/config.hpp"
#include "gelslam/viewer/view_window.hpp"
#include "live_command.hpp"
#include "simulated_camera.hpp"

namespace gelslam {
namespace {

struct ScanArguments {
  std::vector<std::string> devices;  ///< two: of two sensors that are fixed to each other
  bool no_log = false, resized = false;
  LiveArguments live;
};

/// What to play where there is no camera, as the person chooses; nothing when they close the window.
std::optional<std::filesystem::path> choose_instead_of_camera(const std::string& complaint,
                                                              const LiveArguments& live) {
  Choices choices = logs_to_replay(std::filesystem::current_path());
  choices.complaint = complaint;
  choices.choices.insert(
      choices.choices.begin(),
      {"Simulated sensor", "a pebble; at the first time its model is trained, for some seconds",
       simulated_camera_name()});
  viewer::WindowLoopOptions options;
  options.title = "GelSLAM";
  options.ui_scale = live.ui_scale;
  return run_choose_window(choices, options);
}

/// The command that goes on with the run whose folder comes next. What the run knows (configuration, model)
/// is left out.
std::vector<std::string> go_on(const ScanArguments& arguments) {
  std::vector<std::string> words{"scan"};
  for (const std::string& device : arguments.devices) words.push_back("--camera=" + device);
  if (arguments.no_log) words.emplace_back("--no-log");
  if (arguments.resized) words.emplace_back("--resized");
  for (std::string& word : arguments.live.stream.words()) words.push_back(std::move(word));
  words.emplace_back("--continue");
  return words;
}

using Cameras = std::vector<std::unique_ptr<RawFrameSource>>;

/// Plays a log, or the simulated sensor, in the camera's place. What it shows is not recorded once more.
int run_without_camera(const std::filesystem::path& source, LiveArguments live) {
  const bool simulated = source == simulated_camera_name();
  if (simulated && live.log.models.empty()) live.log.models = {simulated_camera_model(live.quiet).string()};
  const Config config = resolve_config(live.input(simulated ? "" : source.string()));
  LiveOptions options = live.options(config);
  if (!simulated) options.log = source;
  WindowOptions window = prepare_window(options, live);
  if (!simulated) return run_live(pace(open_raw_log(source, config.sensor)), options, live, window);
  const auto open = [] {
    Cameras cameras;
    cameras.push_back(pace(open_simulated_camera()));
    return cameras;
  };
  return run_live(std::move(open().front()), options, live, window,
                  {open, {config}, go_on({{source.string()}, false, false, live})});
}

/// Where a person is at a window and asked for no particular camera, they can choose something else.
bool may_choose(const ScanArguments& arguments) {
  const LiveArguments& live = arguments.live;
  return !live.headless && live.script.empty() && arguments.devices.empty() && live.continued.empty();
}

/// Called where `error` is handled: offers what can be shown instead, or throws it again.
int run_instead(const ScanArguments& arguments, const Error& error) {
  if (!may_choose(arguments)) throw;
  const auto chosen = choose_instead_of_camera(error.what(), arguments.live);
  if (!chosen) throw;
  return run_without_camera(*chosen, arguments.live);
}

Cameras frames_of(std::vector<CameraInput> inputs) {
  Cameras cameras;
  for (CameraInput& input : inputs) cameras.push_back(std::move(input.frames));
  return cameras;
}

int run_two(const ScanArguments& arguments) {
  const LiveArguments& live = arguments.live;
  const std::array<Config, 2> configs = {resolve_config(live.input("", 0, 2)),
                                         resolve_config(live.input("", 1, 2))};
  const std::array<LiveOptions, 2> options = live.options_of_two(configs);
  for (const LiveOptions& of_sensor : options) check_run_folder(of_sensor);
  const auto open = [&] { return open_camera_inputs(configs, arguments.devices); };
  std::vector<CameraInput> cameras = open();
  std::array<LiveRig::Sensor, 2> sensors;
  for (std::size_t i = 0; i < 2; ++i) {
    sensors[i] = {std::move(cameras[i].frames), options[i]};
    if (!arguments.no_log) sensors[i].options.record = cameras[i].attachments;
    sensors[i].options.record_resized = arguments.resized;
  }
  return run_live_rig(std::move(sensors), live,
                      {[&] { return frames_of(open()); }, {configs[0], configs[1]}, {}});
}

int run(ScanArguments arguments) {
  LiveArguments& live = arguments.live;
  if (live.run_folder.empty() && live.continued.empty()) live.run_folder = name_by_time();
  if (arguments.devices.size() == 2) return run_two(arguments);
  if (!live.rig.empty()) throw Error("--rig is for two sensors: give --camera twice");
  const std::string device = arguments.devices.empty() ? "" : arguments.devices.front();
  if (device == simulated_camera_name()) return run_without_camera(device, live);
  Config config;
  try {
    config = resolve_config(live.input(""));
  } catch (const Error& error) {
    if (!live.log.models.empty() || !live.log.configs.empty()) throw;  // there is a mistake in them
    return run_instead(arguments, error);
  }
  LiveOptions options = live.options(config);
  WindowOptions window = prepare_window(options, live);
  const auto open = [&] { return open_camera_inputs({&config, 1}, {&device, 1}); };
  std::vector<CameraInput> cameras;
  try {
    cameras = open();
  } catch (const Error& error) {
    return run_instead(arguments, error);
  }
  if (!arguments.no_log) options.record = cameras.front().attachments;
  options.record_resized = arguments.resized;
  return run_live(std::move(cameras.front().frames), options, live, std::move(window),
                  {[&] { return frames_of(open()); }, {config}, go_on(arguments)});
}

}  // namespace

void add_scan_command(CLI::App& app, int& exit_code) {
  auto arguments = std::make_shared<ScanArguments>();
  CLI::App* command =
      app.add_subcommand("scan", "Roll an object across the sensor and watch its surface grow");
  command
      ->add_option("--camera", arguments->devices,
                   "Camera: /dev/video2, 2, or part of its name (default: the configuration's); "
                   "\"simulated\" for one to try the program with. Twice: two sensors that are fixed to each "
                   "other make one map")
      ->expected(1, 2)
      ->allow_extra_args(false);
  CLI::Option* no_log =
      command->add_flag("--no-log", arguments->no_log, "Do not record the camera's pictures");
  command
      ->add_flag("--resized", arguments->resized,
                 "Record at the calibrated resolution, lossless, instead of the camera's own bytes")
      ->excludes(no_log);
  arguments->live.add_to(*command);
  command->footer(
      "Begin with nothing on the gel. Ctrl-C stops and saves; a second one saves at once what there is.\n"
      "Without a camera, the window offers a simulated one and recent logs.\n"
      "Example: gelslam scan --model nnmodel.pth -o runs/shell\n"
      "         gelslam scan --continue runs/shell\n"
      "         gelslam scan --camera 0 --camera 2 -o runs/held");
  command->callback([arguments, &exit_code] { exit_code = run(*arguments); });
}

}  // namespace gelslam
