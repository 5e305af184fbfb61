#include <iostream>
#include <memory>

#include "command_line.hpp"
#include "commands.hpp"
#include "gelslam/core/error.hpp"
#include "gelslam/core/process.hpp"
#include "gelslam/sensor/raw_log.hpp"
#include "gelslam/slam/reconstruct.hpp"
#include "gelslam/slam/sensor_rig.hpp"
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

int run(const ReconstructArguments& arguments, bool with_rig) {
  std::vector<std::filesystem::path> logs(arguments.logs.begin(), arguments.logs.end());
  if (logs.size() > 1 && !with_rig)
    throw Error("reconstruct takes one log, or with --rig those of two sensors");
  if (logs.size() == 1) logs = sensors_of_log(logs.front());
  if (logs.size() > 2 || (with_rig && logs.size() != 2)) throw Error("--rig takes the logs of two sensors");
  if (logs.size() == 2) check_two_sensors(logs[0], logs[1]);
  ReconstructRequest request;
  request.rig = read_given_rig(arguments.rig);
  request.input =
      with_settings_of_run(arguments.log.input(logs.front(), 0, logs.size()), arguments.continued);
  request.config = resolve_config(request.input);
  request.run_folder = arguments.run_folder;
  request.overwrite = arguments.overwrite;
  request.continued_run = arguments.continued;
  if (logs.size() == 2) {
    if (!arguments.continued.empty())
      throw Error(arguments.logs.front() +
                  " holds two sensors; --continue takes one: " + arguments.logs.front() + "#1");
    request.second = arguments.log.input(logs.back(), 1, 2);
  }
  const InterruptWatch interrupt;
  const std::unique_ptr<ProgressSink> progress = make_progress(arguments.quiet);
  const RunReport report = reconstruct(request, *progress, [&] { return interrupt.requested(); }).report;
  std::cerr << run_words(report, arguments.run_folder, arguments.quiet);
  if (report.frames.tracked == 0) std::cerr << "nothing ever touched the sensor: the mesh is empty\n";
  const bool is_good = report.frames.tracked > 0 && (!request.second || report.complete());
  return is_good ? kExitDone : kExitNotGood;
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
