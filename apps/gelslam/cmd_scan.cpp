#include <memory>

#include "camera_input.hpp"
#include "commands.hpp"
#include "gelslam/slam/config.hpp"
#include "live_command.hpp"

namespace gelslam {
namespace {

struct ScanArguments {
  std::string device;
  bool no_log = false, resized = false;
  LiveArguments live;
};

int run(ScanArguments arguments) {
  LiveArguments& live = arguments.live;
  if (live.run_folder.empty() && live.continued.empty()) live.run_folder = name_by_time();
  const Config config = resolve_config(live.input(""));
  LiveOptions options = live.options(config);
  WindowOptions window = prepare_window(options, live);
  CameraInput camera = open_camera_input(config, arguments.device);
  if (!arguments.no_log) options.record = camera.attachments;
  options.record_resized = arguments.resized;
  return run_live(std::move(camera.frames), options, live, std::move(window));
}

}  // namespace

void add_scan_command(CLI::App& app, int& exit_code) {
  auto arguments = std::make_shared<ScanArguments>();
  CLI::App* command =
      app.add_subcommand("scan", "Roll an object across the sensor and watch its surface grow");
  command->add_option("--camera", arguments->device,
                      "Camera: /dev/video2, 2, or part of its name (default: the configuration's)");
  CLI::Option* no_log =
      command->add_flag("--no-log", arguments->no_log, "Do not record the camera's pictures");
  command
      ->add_flag("--resized", arguments->resized,
                 "Record at the calibrated resolution, lossless, instead of the camera's own bytes")
      ->excludes(no_log);
  arguments->live.add_to(*command);
  command->footer(
      "Begin with nothing on the gel. Ctrl-C stops and saves; a second one saves at once what there is.\n"
      "Example: gelslam scan --model nnmodel.pth -o runs/shell\n"
      "         gelslam scan --continue runs/shell");
  command->callback([arguments, &exit_code] { exit_code = run(*arguments); });
}

}  // namespace gelslam
