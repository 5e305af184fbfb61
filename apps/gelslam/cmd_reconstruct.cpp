#include <fmt/core.h>

#include <iostream>
#include <memory>

#include "command_line.hpp"
#include "commands.hpp"
#include "gelslam/core/interrupt.hpp"
#include "gelslam/core/text.hpp"
#include "gelslam/slam/reconstruct.hpp"
#include "reports.hpp"
#include "terminal_progress.hpp"

namespace gelslam {
namespace {

struct ReconstructArguments {
  LogOptions log;
  std::string run_folder;
  bool overwrite = false, quiet = false;
};

std::string in_words(const ReconstructSummary& s, const std::string& run_folder) {
  std::string text;
  if (s.partial) text += "stopped early: this is what was seen so far\n";
  if (!s.warning.empty()) text += "warning: " + s.warning + "\n";
  text += fmt::format("{} of {} frames tracked, {}\n{}, in {} s: {}\n", s.tracked, s.frames, map_words(s),
                      mesh_words(s), short_number(s.seconds, 3), run_folder);
  if (!s.completeness.complete()) text += describe(s.completeness) + "\n";
  return text;
}

int run(const ReconstructArguments& arguments) {
  ReconstructRequest request;
  request.input = arguments.log.input();
  request.config = resolve_config(request.input);
  request.run_folder = arguments.run_folder;
  request.overwrite = arguments.overwrite;
  const InterruptWatch interrupt;
  const std::unique_ptr<ProgressSink> progress = make_progress(arguments.quiet);
  const ReconstructSummary summary = reconstruct(request, *progress, [&] { return interrupt.requested(); });
  if (!arguments.quiet) std::cerr << in_words(summary, arguments.run_folder);
  if (summary.tracked == 0) {
    std::cerr << "nothing ever touched the sensor: the mesh is empty\n";
    return exit_not_good;
  }
  return exit_done;
}

}  // namespace

void add_reconstruct_command(CLI::App& app, int& exit_code) {
  auto arguments = std::make_shared<ReconstructArguments>();
  CLI::App* command = app.add_subcommand("reconstruct", "Turn a recorded log into a mesh and a trajectory");
  arguments->log.add_to(*command);
  command->add_option("-o,--output", arguments->run_folder, "Run folder to write")->required();
  command->add_flag("--overwrite", arguments->overwrite, "Replace the run folder if it is there");
  add_quiet_flag(*command, arguments->quiet);
  command->footer("Example: gelslam reconstruct data/pebble -o runs/pebble");
  command->callback([arguments, &exit_code] { exit_code = run(*arguments); });
}

}  // namespace gelslam
