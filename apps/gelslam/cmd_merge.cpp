#include <iostream>
#include <memory>

#include "command_line.hpp"
#include "commands.hpp"
#include "gelslam/core/process.hpp"
#include "gelslam/slam/merge_scans.hpp"
#include "reports.hpp"
#include "terminal_progress.hpp"

namespace gelslam {
namespace {

struct MergeArguments {
  std::vector<std::string> runs;
  std::string run_folder;
  bool overwrite = false, quiet = false;
};

int run(const MergeArguments& arguments) {
  MergeRequest request;
  request.runs.assign(arguments.runs.begin(), arguments.runs.end());
  request.run_folder = arguments.run_folder;
  request.overwrite = arguments.overwrite;
  const InterruptWatch interrupt;
  const std::unique_ptr<ProgressSink> progress = make_progress(arguments.quiet);
  const RunReport report = merge_scans(request, *progress, [&] { return interrupt.requested(); }).report;
  std::cerr << run_words(report, arguments.run_folder, arguments.quiet);
  return report.complete() ? kExitDone : kExitNotGood;
}

}  // namespace

void add_merge_command(CLI::App& app, int& exit_code) {
  auto arguments = std::make_shared<MergeArguments>();
  CLI::App* command = app.add_subcommand("merge", "Join scans of one object by one sensor");
  command
      ->add_option("RUN", arguments->runs, "Run folders, two or more; the first one's configuration is used")
      ->required()
      ->expected(2, CLI::detail::expected_max_vector_size);
  command->add_option("-o,--output", arguments->run_folder, "Run folder to write")->required();
  add_overwrite_flag(*command, arguments->overwrite);
  add_quiet_flag(*command, arguments->quiet);
  command->footer(
      "Scans join where they show the same places. The exit code is 1 when something did not join.\n"
      "Example: gelslam merge runs/top runs/bottom -o runs/whole");
  command->callback([arguments, &exit_code] { exit_code = run(*arguments); });
}

}  // namespace gelslam
