#include <array>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "commands.hpp"
#include "gelslam/core/error.hpp"
#include "gelslam/sensor/frame_source.hpp"
#include "gelslam/sensor/raw_log.hpp"
#include "live_command.hpp"

namespace gelslam {
namespace {

struct ReplayArguments {
  std::vector<std::string> logs;
  double speed = 1.0;
  bool every_frame = false;
  LiveArguments live;
};

std::unique_ptr<RawFrameSource> open_log(const ReplayArguments& arguments, std::size_t sensor,
                                         const Config& config) {
  const auto speed = arguments.every_frame ? std::nullopt : std::optional(arguments.speed);
  return pace(open_raw_log(arguments.logs[sensor], config.sensor), speed);
}

int run_two(const ReplayArguments& arguments) {
  const LiveArguments& live = arguments.live;
  check_two_sensors(arguments.logs[0], arguments.logs[1]);
  std::array<Config, 2> configs;
  for (std::size_t i = 0; i < 2; ++i) configs[i] = resolve_config(live.input(arguments.logs[i], i, 2));
  std::array<LiveOptions, 2> options = live.options_of_two(configs);
  std::array<LiveRig::Sensor, 2> sensors;
  for (std::size_t i = 0; i < 2; ++i) {
    options[i].log = arguments.logs[i];
    options[i].drop_when_behind = !arguments.every_frame;
    open_frame_source(arguments.logs[i], configs[i].sensor)->next();
    sensors[i] = {open_log(arguments, i, configs[i]), options[i]};
  }
  return run_live_rig(std::move(sensors), live);
}

int run(ReplayArguments arguments) {
  if (arguments.logs.size() == 1) {
    const std::vector<std::filesystem::path> sensors = sensors_of_log(arguments.logs.front());
    arguments.logs.assign(sensors.begin(), sensors.end());
  }
  if (arguments.logs.size() == 2) return run_two(arguments);
  const LiveArguments& live = arguments.live;
  if (!live.rig.empty()) throw Error("--rig takes the logs of two sensors");
  const std::string& log = arguments.logs.front();
  const Config config = resolve_config(live.input(log));
  LiveOptions options = live.options(config);
  options.log = log;
  options.drop_when_behind = !arguments.every_frame;
  WindowOptions window = prepare_window(options, live);
  // A log of another camera is refused before a run folder is made, or replaced.
  open_frame_source(log, config.sensor)->next();
  return run_live(open_log(arguments, 0, config), options, live, std::move(window));
}

}  // namespace

void add_replay_command(CLI::App& app, int& exit_code) {
  auto arguments = std::make_shared<ReplayArguments>();
  CLI::App* command = app.add_subcommand(
      "replay", "Play a recorded log through the live program, as if it came from a camera");
  command
      ->add_option("LOG", arguments->logs,
                   "Log (.mkv), video, folder of images, or data folder; two of them, or one of two sensors: "
                   "sensors that are fixed to each other")
      ->required()
      ->expected(1, 2);
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
