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

int run(ReplayArguments arguments) {
  std::vector<std::string>& logs = arguments.logs;
  if (logs.size() == 1) {
    const std::vector<std::filesystem::path> sensors = sensors_of_log(logs.front());
    logs.assign(sensors.begin(), sensors.end());
  }
  if (logs.size() == 2) check_two_sensors(logs[0], logs[1]);
  const LiveArguments& live = arguments.live;
  const std::vector<Config> configs = live.configs(logs);
  std::vector<LiveOptions> options = live.options(configs);
  for (std::size_t i = 0; i < logs.size(); ++i) {
    options[i].log = logs[i];
    options[i].drop_when_behind = !arguments.every_frame;
  }
  WindowOptions window = prepare_window(options, live);
  // A log of another camera is refused before a run folder is made, or replaced.
  for (std::size_t i = 0; i < logs.size(); ++i) open_frame_source(logs[i], configs[i].sensor)->next();
  const auto speed = arguments.every_frame ? std::nullopt : std::optional(arguments.speed);
  RawFrameSources sources;
  for (std::size_t i = 0; i < logs.size(); ++i)
    sources.push_back(pace(open_raw_log(logs[i], configs[i].sensor), speed));
  return run_live(std::move(sources), std::move(options), live, std::move(window));
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
