#include <memory>
#include <string>

#include "camera_input.hpp"
#include "commands.hpp"
#include "gelslam/slam/config.hpp"
#include "live_command.hpp"
#include "simulated_camera.hpp"

namespace gelslam {
namespace {

struct ScanArguments {
  std::string device;  ///< "": the configuration's
  bool no_log = false, resized = false;
  LiveArguments live;
};

/// Plays the simulated sensor in the camera's place. What it shows is not recorded.
int run_simulated(LiveArguments live) {
  if (live.log.model.empty()) live.log.model = simulated_camera_model().string();
  const Config config = live.config("");
  LiveOptions options = live.options(config);
  const WindowOptions window = prepare_window(options, live);
  const auto open = [] { return pace(open_simulated_camera()); };
  return run_live(open(), std::move(options), live, window, {open, config});
}

int run(ScanArguments arguments) {
  LiveArguments& live = arguments.live;
  if (live.run_folder.empty() && live.continued.empty()) live.run_folder = name_by_time();
  if (arguments.device == simulated_camera_name()) return run_simulated(live);
  const Config config = live.config("");
  LiveOptions options = live.options(config);
  WindowOptions window = prepare_window(options, live);
  CameraInput camera = open_camera_input(config, arguments.device);
  if (!arguments.no_log) options.record = camera.attachments;
  options.record_resized = arguments.resized;
  return run_live(std::move(camera.frames), std::move(options), live, std::move(window),
                  {[&] { return open_camera_input(config, arguments.device).frames; }, config});
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
      "Without a camera: gelslam scan --camera simulated, or gelslam replay LOG.\n"
      "Example: gelslam scan --model nnmodel.pth -o runs/shell\n"
      "         gelslam scan --continue runs/shell");
  command->callback([arguments, &exit_code] { exit_code = run(*arguments); });
}

}  // namespace gelslam
