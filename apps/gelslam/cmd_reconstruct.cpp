#include <iostream>
#include <memory>

#include "command_line.hpp"
#include "commands.hpp"
#include "gelslam/core/process.hpp"
#include "gelslam/slam/reconstruct.hpp"
#include "live_command.hpp"
#include "reports.hpp"
#include "terminal_progress.hpp"

namespace gelslam {
namespace {

struct ReconstructArguments {
  std::string log;
  LogOptions settings;
  std::string run_folder, continued;
  ServeOptions serve;
  bool overwrite = false, quiet = false;
};

/// Runs the log as a live scan without dropped frames, which gives the same map and can be watched.
int run_served(const ReconstructArguments& arguments) {
  LiveArguments live;
  live.log = arguments.settings;
  live.run_folder = arguments.run_folder;
  live.overwrite = arguments.overwrite;
  live.quiet = arguments.quiet;
  live.headless = true;
  live.stream.serve = arguments.serve;
  return run_live_log(arguments.log, live, /*every_frame=*/true);
}

int run_reconstruct(const ReconstructArguments& arguments) {
  if (!arguments.serve.address.empty()) return run_served(arguments);
  const LogInput input = with_settings_of_run(arguments.settings.input(arguments.log), arguments.continued);
  const ReconstructRequest request{.input = input,
                                   .config = resolve_config(input),
                                   .run_folder = arguments.run_folder,
                                   .overwrite = arguments.overwrite,
                                   .continued_run = arguments.continued};
  const InterruptWatch interrupt;
  const std::unique_ptr<ProgressSink> progress = make_progress(arguments.quiet);
  const RunReport report = reconstruct(request, *progress, [&] { return interrupt.requested(); }).report;
  std::cerr << run_words(report, arguments.run_folder, arguments.quiet);
  return report.good() ? kExitDone : kExitNotGood;
}

}  // namespace

void add_reconstruct_command(CLI::App& app, int& exit_code) {
  CLI::App* command = app.add_subcommand("reconstruct", "Turn a recorded log into a mesh and a trajectory");
  auto& arguments = options_of(*command, exit_code, run_reconstruct);
  command
      ->add_option("LOG", arguments.log,
                   "Recorded log, video, folder of images, or data folder (config.yaml, gelsight.avi)")
      ->required();
  arguments.settings.add_to(*command);
  command->add_option("-o,--output", arguments.run_folder, "Run folder to write")->required();
  CLI::Option* continued = command->add_option(
      "--continue", arguments.continued,
      "Run folder that the log continues: the same object, sensor and model. It stays as it is");
  command->add_flag("--overwrite", arguments.overwrite, "Replace the run folder if it is there");
  add_serve_option(*command, arguments.serve)->excludes(continued);
  add_quiet_flag(*command, arguments.quiet);
  command->footer(
      "Example: gelslam reconstruct data/pebble -o runs/pebble\n"
      "         gelslam reconstruct more.mkv --continue runs/pebble -o runs/pebble-more");
}

}  // namespace gelslam
