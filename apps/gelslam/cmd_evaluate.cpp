#include <filesystem>
#include <iostream>
#include <memory>

#include "command_line.hpp"
#include "commands.hpp"
#include "gelslam/core/error.hpp"
#include "gelslam/core/files.hpp"
#include "gelslam/evaluation/evaluation.hpp"
#include "gelslam/mesh/mesh_io.hpp"
#include "terminal_progress.hpp"

namespace gelslam {
namespace {

struct EvaluateArguments {
  std::filesystem::path run, data_folder;
  std::filesystem::path mesh, truth_mesh;
  std::filesystem::path results;
  MeshUnit unit;
  bool json = false, overwrite = false, quiet = false;
};

Evaluation judge(const EvaluateArguments& arguments, ProgressSink& progress) {
  if (!arguments.mesh.empty())
    return evaluate({read_mesh(arguments.mesh, arguments.unit.mm(arguments.mesh)),
                     read_mesh(arguments.truth_mesh, arguments.unit.mm(arguments.truth_mesh))},
                    &progress);
  if (arguments.run.empty())
    throw Error("nothing to evaluate: give RUN and --truth DATA, or --mesh and --truth-mesh");
  const Comparison comparison = compare(arguments.run, arguments.data_folder);
  return evaluate(comparison, place_meshes(comparison), &progress);
}

void run_evaluate(const EvaluateArguments& arguments) {
  check_output_file(arguments.results, arguments.overwrite);
  const std::unique_ptr<ProgressSink> progress = make_progress(arguments.quiet);
  const Evaluation evaluation = judge(arguments, *progress);
  if (!arguments.quiet)
    for (const std::filesystem::path& mesh : {arguments.mesh, arguments.truth_mesh}) arguments.unit.say(mesh);
  if (!arguments.results.empty()) write_file_atomically(arguments.results, to_json(evaluation));
  std::cout << (arguments.json ? to_json(evaluation) : to_table(evaluation));
}

}  // namespace

void add_evaluate_command(CLI::App& app, int& exit_code) {
  CLI::App* command =
      app.add_subcommand("evaluate", "Measure a run's trajectory and mesh against ground truth");
  const auto arguments = std::make_shared<EvaluateArguments>();
  CLI::Option* run = command->add_option("RUN", arguments->run,
                                         "Run folder (trajectory.tum, report.json, mesh.ply) or a .tum file");
  CLI::Option* truth =
      command->add_option("--truth", arguments->data_folder,
                          "Data folder with true_start_T_currs.npy (and gt_mesh.ply, touched.npy)");
  run->needs(truth);
  truth->needs(run);
  CLI::Option* mesh = command->add_option("--mesh", arguments->mesh, "Only a mesh (PLY, OBJ or STL)");
  CLI::Option* truth_mesh =
      command->add_option("--truth-mesh", arguments->truth_mesh, "Its true shape, in the same frame");
  mesh->needs(truth_mesh)->excludes(run);
  truth_mesh->needs(mesh);
  arguments->unit.add_to(*command);
  command->add_flag("--json", arguments->json, "Print JSON instead of a table");
  command->add_option("-o,--output", arguments->results, "Also write the results to this JSON file");
  add_overwrite_flag(*command, arguments->overwrite);
  add_quiet_flag(*command, arguments->quiet);
  command->footer("Example: gelslam evaluate RUN --truth DATA -o results.json");
  command->callback([arguments, &exit_code] {
    run_evaluate(*arguments);
    exit_code = kExitDone;
  });
}

}  // namespace gelslam
