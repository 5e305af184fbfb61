#include <filesystem>
#include <iostream>
#include <memory>

#include "command_line.hpp"
#include "commands.hpp"
#include "gelslam/evaluation/evaluation.hpp"
#include "gelslam/mesh/mesh_io.hpp"
#include "reports.hpp"
#include "terminal_progress.hpp"

namespace gelslam {
namespace {

struct EvaluateArguments {
  std::filesystem::path run, truth;
  bool json = false, quiet = false;
};

bool compares_meshes(const EvaluateArguments& arguments) { return is_mesh_name(arguments.truth); }

/// Evaluates a mesh with a true mesh, or a run with the data folder of its log or with a trajectory.
Evaluation judge(const EvaluateArguments& arguments, ProgressSink& progress) {
  if (compares_meshes(arguments))
    return evaluate({read_mesh(arguments.run), read_mesh(arguments.truth)}, &progress);
  const Comparison comparison = compare(arguments.run, arguments.truth);
  return evaluate(comparison, place_meshes(comparison), &progress);
}

int run_evaluate(const EvaluateArguments& arguments) {
  const std::unique_ptr<ProgressSink> progress = make_progress(arguments.quiet);
  const Evaluation evaluation = judge(arguments, *progress);
  if (!arguments.quiet && compares_meshes(arguments))
    for (const std::filesystem::path& mesh : {arguments.run, arguments.truth}) say_mesh_unit(mesh);
  std::cout << (arguments.json ? to_json(evaluation) : to_table(evaluation));
  warn(evaluation.warning());
  return kExitDone;
}

}  // namespace

void add_evaluate_command(CLI::App& app, int& exit_code) {
  CLI::App* command =
      app.add_subcommand("evaluate", "Measure a run's trajectory and mesh against ground truth");
  auto& arguments = options_of(*command, exit_code, run_evaluate);
  command
      ->add_option("RUN", arguments.run,
                   "Run folder (trajectory.tum, report.json, mesh.ply), .tum file, or mesh (PLY, OBJ or STL)")
      ->required();
  command
      ->add_option("--truth", arguments.truth,
                   "Data folder with true_start_T_currs.npy (and gt_mesh.ply, touched.npy); or the sensor's "
                   "trajectory by another system, as motion capture (TUM); of a mesh its true shape, in the "
                   "same frame")
      ->required();
  command->add_flag("--json", arguments.json, "Print JSON instead of a table");
  add_quiet_flag(*command, arguments.quiet);
  command->footer("Example: gelslam evaluate RUN --truth DATA --json > results.json");
}

}  // namespace gelslam
