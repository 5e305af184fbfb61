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
  std::string device;  ///< "": the configuration's
  bool no_log = false, resized = false;
  LiveArguments live;
};

/// What to play where there is no camera, as the person chooses; nothing when they close the window.
std::optional<std::filesystem::path> choose_instead_of_camera(const std::string& complaint,
                                                              const LiveArguments& live) {
  Choices choices = logs_to_replay(std::filesystem::current_path());
  choices.complaint = complaint;
  choices.choices.insert(choices.choices.begin(), {"Simulated sensor", "a pebble", simulated_camera_name()});
  viewer::WindowLoopOptions options;
  options.title = "GelSLAM";
  options.ui_scale = live.ui_scale;
  return run_choose_window(choices, options);
}

/// The command that goes on with the run whose folder comes next. What the run knows (configuration, model)
/// is left out.
std::vector<std::string> go_on(const ScanArguments& arguments) {
  std::vector<std::string> words{"scan"};
  if (!arguments.device.empty()) words.push_back("--camera=" + arguments.device);
  if (arguments.no_log) words.emplace_back("--no-log");
  if (arguments.resized) words.emplace_back("--resized");
  for (std::string& word : arguments.live.stream.words()) words.push_back(std::move(word));
  words.emplace_back("--continue");
  return words;
}

/// Plays a log, or the simulated sensor, in the camera's place. What it shows is not recorded once more.
int run_without_camera(const std::filesystem::path& source, LiveArguments live) {
  const bool simulated = source == simulated_camera_name();
  if (simulated && live.log.model.empty()) live.log.model = simulated_camera_model().string();
  const Config config = live.config(simulated ? "" : source.string());
  LiveOptions options = live.options(config);
  if (!simulated) options.log = source;
  const WindowOptions window = prepare_window(options, live);
  const auto open = [&] {
    return pace(simulated ? open_simulated_camera() : open_raw_log(source, config.sensor));
  };
  if (!simulated) return run_live(open(), std::move(options), live, window);
  return run_live(open(), std::move(options), live, window,
                  {open, config, go_on({source.string(), false, false, live})});
}

/// Where a person is at a window and asked for no particular camera, they can choose something else.
bool may_choose(const ScanArguments& arguments) {
  const LiveArguments& live = arguments.live;
  return !live.headless && live.script.empty() && arguments.device.empty() && live.continued.empty();
}

/// Called where `error` is handled: offers what can be shown instead, or throws it again.
int run_instead(const ScanArguments& arguments, const Error& error) {
  if (!may_choose(arguments)) throw;
  const auto chosen = choose_instead_of_camera(error.what(), arguments.live);
  if (!chosen) throw;
  return run_without_camera(*chosen, arguments.live);
}

int run(ScanArguments arguments) {
  LiveArguments& live = arguments.live;
  if (live.run_folder.empty() && live.continued.empty()) live.run_folder = name_by_time();
  if (arguments.device == simulated_camera_name()) return run_without_camera(arguments.device, live);
  Config config;
  try {
    config = live.config("");
  } catch (const Error& error) {
    if (!live.log.model.empty() || !live.log.config.empty()) throw;  // there is a mistake in them
    return run_instead(arguments, error);
  }
  LiveOptions options = live.options(config);
  WindowOptions window = prepare_window(options, live);
  CameraInput camera;
  try {
    camera = open_camera_input(config, arguments.device);
  } catch (const Error& error) {
    return run_instead(arguments, error);
  }
  if (!arguments.no_log) options.record = camera.attachments;
  options.record_resized = arguments.resized;
  return run_live(
      std::move(camera.frames), std::move(options), live, std::move(window),
      {[&] { return open_camera_input(config, arguments.device).frames; }, config, go_on(arguments)});
}

}  // namespace

void add_scan_command(CLI::App& app, int& exit_code) {
  auto arguments = std::make_shared<ScanArguments>();
  CLI::App* command =
      app.add_subcommand("scan", "Roll an object across the sensor and watch its surface grow");
  command->add_option("--camera", arguments->device,
                      "Camera: /dev/video2, 2, or part of its name (default: the configuration's); "
                      "\"simulated\" for one to try the program with");
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
      "         gelslam scan --continue runs/shell");
  command->callback([arguments, &exit_code] { exit_code = run(*arguments); });
}

}  // namespace gelslam
