#include <string>

#include "commands.hpp"
#include "gelslam/slam/config.hpp"
#include "live_command.hpp"

namespace gelslam {
namespace {

struct ScanArguments {
  std::string log;     ///< Empty for a camera.
  std::string device;  ///< Empty for the configuration's device.
  bool no_log = false, every_frame = false;
  LiveArguments live;
};

int run_scan(ScanArguments& arguments) {
  if (!arguments.log.empty()) return run_live_log(arguments.log, arguments.live, arguments.every_frame);
  LiveArguments& live = arguments.live;
  if (live.run_folder.empty() && live.continued.empty()) live.run_folder = name_by_time();
  use_simulated_model(arguments.device, live.log.model);
  const Config config = live.config("");
  return run_live(live.options(config), live, [&] {
    CameraInput camera = open_camera_input(config, arguments.device, kReconnectTimeoutS);
    if (arguments.no_log) camera.attachments.reset();
    return camera;
  });
}

}  // namespace

void add_scan_command(CLI::App& app, int& exit_code) {
  CLI::App* command =
      app.add_subcommand("scan", "Roll an object across the sensor and watch its surface grow");
  auto& arguments = options_of(*command, exit_code, run_scan);
  CLI::Option* log = command->add_option(
      "LOG", arguments.log, "Instead of a camera: a log (.mkv), video, folder of images, or data folder");
  command
      ->add_option("--camera", arguments.device,
                   "Camera: /dev/video2, 2, or part of its name (default: the configuration's); "
                   "\"simulated\" for one to try the program with")
      ->excludes(log);
  command->add_flag("--no-log", arguments.no_log, "Do not record the camera's pictures")->excludes(log);
  command
      ->add_flag("--every-frame", arguments.every_frame,
                 "Play LOG as fast as possible without dropping a frame")
      ->needs(log);
  arguments.live.add_to(*command);
  add_keep_free_option(*command, arguments.live.keep_free_bytes);
  command->footer(
      "Begin with nothing on the gel. Ctrl-C stops and saves; a second one saves at once what there is.\n"
      "Without a camera: gelslam scan --camera simulated, or gelslam scan LOG.\n"
      "Example: gelslam scan --model nnmodel.pth -o runs/shell\n"
      "         gelslam scan --continue runs/shell\n"
      "         gelslam scan runs/shell/log.mkv -o runs/shell-again");
}

}  // namespace gelslam
