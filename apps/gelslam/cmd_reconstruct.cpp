#include <iostream>
#include <memory>

#include "command_line.hpp"
#include "commands.hpp"
#include "gelslam/core/error.hpp"
#include "gelslam/core/process.hpp"
#include "gelslam/sensor/raw_log.hpp"
#include "gelslam/slam/merge_scans.hpp"
#include "many_logs.hpp"
#include "reports.hpp"
#include "terminal_progress.hpp"

namespace gelslam {
namespace {

struct ReconstructArguments {
  std::vector<std::string> logs;
  LogOptions log;
  std::string run_folder, continued, rig, opening;
  int jobs = 0;
  bool overwrite = false, quiet = false;
};

int report(const ReconstructSummary& summary, const ReconstructArguments& arguments) {
  std::cerr << run_words(summary, arguments.run_folder, arguments.quiet);
  if (summary.tracked > 0) return kExitDone;
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
  const ReconstructSummary summary = reconstruct(request, *progress, [&] { return interrupt.requested(); });
  return report(summary, arguments);
}

/// Two logs, or a log of two sensors.
int run_rig(const ReconstructArguments& arguments) {
  std::vector<std::filesystem::path> logs(arguments.logs.begin(), arguments.logs.end());
  if (logs.size() == 1) logs = sensors_of_log(logs.front());
  if (logs.size() != 2) throw Error("--rig takes the logs of two sensors");
  RigRequest request;
  for (std::size_t sensor = 0; sensor < 2; ++sensor)
    request.inputs[sensor] = arguments.log.input(logs[sensor], sensor, 2);
  request.rig = read_given_rig(arguments.rig, arguments.opening);
  request.run_folder = arguments.run_folder;
  request.overwrite = arguments.overwrite;
  const InterruptWatch interrupt;
  const std::unique_ptr<ProgressSink> progress = make_progress(arguments.quiet);
  const ReconstructSummary summary =
      reconstruct_rig(request, *progress, [&] { return interrupt.requested(); }).account.summary;
  const int exit_code = report(summary, arguments);
  return summary.completeness.complete() ? exit_code : kExitNotGood;
}

int run(const ReconstructArguments& arguments, const CLI::App& command) {
  if (command.count("--rig") > 0) return run_rig(arguments);
  if (arguments.logs.size() == 1 && arguments.jobs == 0) {
    const std::string& log = arguments.logs.front();
    if (sensors_of_log(log).size() < 2) return run_one(arguments);
    if (!arguments.continued.empty())
      throw Error(log + " holds two sensors; --continue takes one: " + log + "#1");
    return run_rig(arguments);
  }
  if (!arguments.continued.empty())
    throw Error("--continue takes one log; continue with the others one after the other");
  return reconstruct_each({arguments.logs, arguments.run_folder,
                           given_options(command, {"--output", "--jobs", "--overwrite"}), arguments.jobs,
                           arguments.overwrite, arguments.quiet});
}

}  // namespace

void add_reconstruct_command(CLI::App& app, int& exit_code) {
  auto arguments = std::make_shared<ReconstructArguments>();
  CLI::App* command = app.add_subcommand("reconstruct", "Turn recorded logs into meshes and trajectories");
  command
      ->add_option("LOG", arguments->logs,
                   "Recorded log, video, folder of images, or data folder (config.yaml, gelsight.avi); or "
                   "several of them")
      ->required();
  arguments->log.add_to(*command);
  command
      ->add_option("-o,--output", arguments->run_folder,
                   "Run folder to write; for several logs, the folder of their run folders, which have the "
                   "names of the logs")
      ->required();
  CLI::Option* jobs =
      command
          ->add_option("--jobs", arguments->jobs,
                       "Logs at a time, as processes of their own (default: one for each core, as far as "
                       "memory allows). With it, -o is the folder of run folders also for one log")
          ->check(CLI::Range(1, 1024));
  command
      ->add_option("--continue", arguments->continued,
                   "Run folder that one log continues: the same object, sensor and model. It stays as it is")
      ->excludes(jobs);
  add_rig_option(*command, arguments->rig,
                 "Two logs that two sensors recorded at the same time (one log may hold both)")
      ->excludes(jobs)
      ->excludes("--continue");
  add_opening_option(*command, arguments->opening)->needs("--rig");
  command->add_flag("--overwrite", arguments->overwrite,
                    "Replace the run folder if it is there (of several logs: also what is finished)");
  add_quiet_flag(*command, arguments->quiet);
  command->footer(
      "Example: gelslam reconstruct data/pebble -o runs/pebble\n"
      "         gelslam reconstruct data/* -o runs --jobs 4\n"
      "         gelslam reconstruct left.mkv right.mkv --rig -o runs/both\n"
      "         gelslam reconstruct both.mkv -o runs/both\n"
      "         gelslam reconstruct more.mkv --continue runs/pebble -o runs/pebble-more");
  command->callback([arguments, command, &exit_code] { exit_code = run(*arguments, *command); });
}

}  // namespace gelslam
