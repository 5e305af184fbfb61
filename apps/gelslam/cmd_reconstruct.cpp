#include <iostream>
#include <memory>

#include "command_line.hpp"
#include "commands.hpp"
#include "gelslam/core/error.hpp"
#include "gelslam/core/process.hpp"
#include "gelslam/sensor/raw_log.hpp"
#include "gelslam/slam/merge_scans.hpp"
#include "reports.hpp"
#include "terminal_progress.hpp"

namespace gelslam {
namespace {

struct ReconstructArguments {
  std::vector<std::string> logs;
  LogOptions log;
  std::string run_folder, continued, rig;
  bool overwrite = false, quiet = false;
};

int say(const RunReport& report, const ReconstructArguments& arguments) {
  std::cerr << run_words(report, arguments.run_folder, arguments.quiet);
  if (report.frames.tracked > 0) return kExitDone;
  std::cerr << "nothing ever touched the sensor: the mesh is empty\n";
  return kExitNotGood;
}

int run_one(const ReconstructArguments& arguments) {
  ReconstructRequest request;
  request.input = with_settings_of_run(arguments.log.input(arguments.logs.front()), arguments.continued);
  request.config = resolve_config(request.input);
  request.run_folder = arguments.run_folder;
  request.overwrite = arguments.overwrite;
  request.continued_run = arguments.continued;
  const InterruptWatch interrupt;
  const std::unique_ptr<ProgressSink> progress = make_progress(arguments.quiet);
  return say(reconstruct(request, *progress, [&] { return interrupt.requested(); }), arguments);
}

int run_rig(const ReconstructArguments& arguments, const std::vector<std::filesystem::path>& logs) {
  if (logs.size() != 2) throw Error("--rig takes the logs of two sensors");
  RigRequest request;
  for (std::size_t sensor = 0; sensor < 2; ++sensor)
    request.inputs[sensor] = arguments.log.input(logs[sensor], sensor, 2);
  request.rig = read_given_rig(arguments.rig);
  request.run_folder = arguments.run_folder;
  request.overwrite = arguments.overwrite;
  const InterruptWatch interrupt;
  const std::unique_ptr<ProgressSink> progress = make_progress(arguments.quiet);
  const RunReport report = reconstruct_rig(request, *progress, [&] { return interrupt.requested(); }).report;
  const int exit_code = say(report, arguments);
  return report.complete() ? exit_code : kExitNotGood;
}

int run(const ReconstructArguments& arguments, bool with_rig) {
  if (arguments.logs.size() > 1) {
    if (!with_rig) throw Error("reconstruct takes one log, or with --rig those of two sensors");
    return run_rig(arguments, {arguments.logs.begin(), arguments.logs.end()});
  }
  const std::string& log = arguments.logs.front();
  const std::vector<std::filesystem::path> sensors = sensors_of_log(log);
  if (!with_rig && sensors.size() < 2) return run_one(arguments);
  if (!arguments.continued.empty())
    throw Error(log + " holds two sensors; --continue takes one: " + log + "#1");
  return run_rig(arguments, sensors);
}

}  // namespace

void add_reconstruct_command(CLI::App& app, int& exit_code) {
  auto arguments = std::make_shared<ReconstructArguments>();
  CLI::App* command = app.add_subcommand("reconstruct", "Turn a recorded log into a mesh and a trajectory");
  command
      ->add_option("LOG", arguments->logs,
                   "Recorded log, video, folder of images, or data folder (config.yaml, gelsight.avi); with "
                   "--rig two of them")
      ->required();
  arguments->log.add_to(*command);
  command->add_option("-o,--output", arguments->run_folder, "Run folder to write")->required();
  command->add_option(
      "--continue", arguments->continued,
      "Run folder that the log continues: the same object, sensor and model. It stays as it is");
  CLI::Option* rig =
      add_rig_option(*command, arguments->rig,
                     "Two logs that two sensors recorded at the same time (one log may hold both)")
          ->excludes("--continue");
  command->add_flag("--overwrite", arguments->overwrite, "Replace the run folder if it is there");
  add_quiet_flag(*command, arguments->quiet);
  command->footer(
      "Example: gelslam reconstruct data/pebble -o runs/pebble\n"
      "         gelslam reconstruct left.mkv right.mkv --rig -o runs/both\n"
      "         gelslam reconstruct both.mkv -o runs/both\n"
      "         gelslam reconstruct more.mkv --continue runs/pebble -o runs/pebble-more");
  command->callback([arguments, rig, &exit_code] { exit_code = run(*arguments, rig->count() > 0); });
}

}  // namespace gelslam
