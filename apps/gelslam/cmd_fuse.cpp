#include <fmt/core.h>

#include <iostream>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "command_line.hpp"
#include "commands.hpp"
#include "gelslam/core/error.hpp"
#include "gelslam/core/process.hpp"
#include "gelslam/core/text.hpp"
#include "gelslam/slam/merge_scans.hpp"
#include "reports.hpp"
#include "terminal_progress.hpp"

namespace gelslam {
namespace {

struct FuseArguments {
  std::vector<std::string> runs;
  std::string output;
  std::optional<double> voxel_size_mm;
  bool overwrite = false, quiet = false, keep_all = false;
};

int join(const FuseArguments& arguments) {
  if (arguments.output.empty()) throw CLI::RequiredError("--output");
  if (arguments.voxel_size_mm || arguments.keep_all)
    throw Error(std::string(arguments.keep_all ? "--keep-all" : "--voxel-size-mm") +
                " is for one run: join the runs first, then fuse the result");
  const MergeRequest request{
      {arguments.runs.begin(), arguments.runs.end()}, arguments.output, arguments.overwrite};
  const InterruptWatch interrupt;
  const std::unique_ptr<ProgressSink> progress = make_progress(arguments.quiet);
  const RunReport report = merge_scans(request, *progress, [&] { return interrupt.requested(); }).report;
  std::cerr << run_words(report, arguments.output, arguments.quiet);
  return report.complete() ? kExitDone : kExitNotGood;
}

int fuse_one(const FuseArguments& arguments) {
  const std::string& run = arguments.runs.front();
  const FuseRequest request{.run = run,
                            .output = arguments.output,
                            .overwrite = arguments.overwrite,
                            .voxel_size_mm = arguments.voxel_size_mm,
                            .truncation_mm = std::nullopt,
                            .keep_all = arguments.keep_all};
  const InterruptWatch interrupt;
  const std::unique_ptr<ProgressSink> progress = make_progress(arguments.quiet);
  const FuseSummary summary = fuse_run(request, *progress, [&] { return interrupt.requested(); });
  if (!arguments.quiet) {
    if (summary.map_was_made) std::cerr << "the scan had not been finished: its map was made first\n";
    std::cerr << touched_line(summary.touched);
    print_line(fmt::format("{} fused, {}: {}",
                           counted(static_cast<std::int64_t>(summary.keyframes), "keyframe"),
                           mesh_words(summary.mesh), arguments.output.empty() ? run : arguments.output));
  }
  if (summary.mesh.triangles == 0)
    warn("no mesh: its cells are larger than the touches, or no keyframe has a usable touch");
  if (!arguments.quiet) print_run_warnings(run);
  return summary.mesh.triangles == 0 ? kExitNotGood : kExitDone;
}

int run_fuse(const FuseArguments& arguments) {
  return arguments.runs.size() > 1 ? join(arguments) : fuse_one(arguments);
}

}  // namespace

void add_fuse_command(CLI::App& app, int& exit_code) {
  CLI::App* command = app.add_subcommand(
      "fuse", "Make a run's mesh again with other settings, without its log, or join scans of one object");
  auto& arguments = options_of(*command, exit_code, run_fuse);
  command
      ->add_option(
          "RUN", arguments.runs,
          "Run folder; two or more, of one sensor, are joined: the first one's configuration is used")
      ->required();
  CLI::Option* output =
      command->add_option("-o,--output", arguments.output,
                          "Run folder to write: RUN with the new mesh, without its logs (default: RUN's own "
                          "mesh is replaced), or the joined runs");
  command->add_flag("--overwrite", arguments.overwrite, "Replace that folder if it is there")->needs(output);
  command->add_option("--voxel-size-mm", arguments.voxel_size_mm, "Edge of the mesh's cells")
      ->check(number_between(0.01, 10));
  command->add_flag("--keep-all", arguments.keep_all,
                    "Keep islands of the mesh: below 1 mm2, or that a single keyframe shows");
  add_quiet_flag(*command, arguments.quiet);
  command->footer(
      "If the scan was killed, the map is made first. Scans join where they show the same places. The exit "
      "code is 1\nwhen something did not join.\n"
      "Example: gelslam fuse runs/pebble --voxel-size-mm 0.05 -o runs/pebble-fine\n"
      "         gelslam fuse runs/top runs/bottom -o runs/whole");
}

}  // namespace gelslam
