#include <memory>
#include <optional>
#include <string>

#include "commands.hpp"
#include "gelslam/sensor/frame_source.hpp"
#include "gelslam/sensor/raw_log.hpp"
#include "live_command.hpp"

namespace gelslam {
namespace {

struct ReplayArguments {
  std::string log;
  double speed = 1.0;
  bool every_frame = false;
  LiveArguments live;
};

int run(const ReplayArguments& arguments) {
  const LiveArguments& live = arguments.live;
  const Config config = live.config(arguments.log);
  LiveOptions options = live.options(config);
  options.log = arguments.log;
  options.drop_when_behind = !arguments.every_frame;
  WindowOptions window = prepare_window(options, live);
  // A log of another camera is refused before a run folder is made, or replaced.
  open_frame_source(arguments.log, config.sensor)->next();
  const auto speed = arguments.every_frame ? std::nullopt : std::optional(arguments.speed);
  return run_live(pace(open_raw_log(arguments.log, config.sensor), speed), std::move(options), live,
                  std::move(window));
}

}  // namespace

void add_replay_command(CLI::App& app, int& exit_code) {
  auto arguments = std::make_shared<ReplayArguments>();
  CLI::App* command = app.add_subcommand(
      "replay", "Play a recorded log through the live program, as if it came from a camera");
  command->add_option("LOG", arguments->log, "Log (.mkv), video, folder of images, or data folder")
      ->required();
  CLI::Option* speed =
      command->add_option("--speed", arguments->speed, "Speed relative to the sensor's own frame rate")
          ->capture_default_str();
  command
      ->add_flag("--every-frame", arguments->every_frame,
                 "Replay as fast as possible without dropping a frame")
      ->excludes(speed);
  arguments->live.add_to(*command);
  command->footer(
      "Example: gelslam replay runs/pebble/log.mkv -o runs/pebble-again\n"
      "         gelslam replay more.mkv --continue runs/pebble-again");
  command->callback([arguments, &exit_code] { exit_code = run(*arguments); });
}

}  // namespace gelslam
