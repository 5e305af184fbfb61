#include <algorithm>
#include <filesystem>
#include <iostream>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "baselines/baselines.hpp"
#include "gelslam/core/process.hpp"
#include "gelslam/core/run_folder.hpp"
#include "protocols/report.hpp"
#include "study.hpp"
#include "terminal_progress.hpp"

namespace gelslam::lab {
namespace {

struct BenchmarkArguments {
  std::vector<std::filesystem::path> data;
  std::vector<std::string> methods = {"normalflow", "icp", "fpfh", "filterreg"};
  std::string protocol = "frame0";
  int every = 1;
  TrialSources sources;
  std::filesystem::path out;
  bool overwrite = false, json = false, quiet = false;
};

BenchmarkRequest request_of(const BenchmarkArguments& arguments) {
  BenchmarkRequest request;
  check_methods(arguments.methods);
  for (const std::string& method : arguments.methods)
    if (std::find(request.methods.begin(), request.methods.end(), method) == request.methods.end())
      request.methods.push_back(method);
  request.make = [](const std::string& method, const NormalFlowOptions& limits) {
    return make_registrar(method, limits);
  };
  request.protocol = arguments.protocol == "frame0" ? Protocol::frame0 : Protocol::keyframes;
  request.every = arguments.every;
  request.sources = arguments.sources;
  request.trials = find_trials(arguments.data);
  return request;
}

/// Pictures of an older result would not belong to the new one: they go with it.
std::vector<std::string> known_entries() {
  std::vector<std::string> names = benchmark_files();
  for (const char* picture : {"accuracy.png", "runtime.png", "error_over_time.png", "trajectory.png"})
    names.push_back(picture);
  return names;
}

void run(const BenchmarkArguments& arguments) {
  const BenchmarkRequest request = request_of(arguments);
  std::optional<RunFolder> folder;
  if (!arguments.out.empty())
    folder.emplace(arguments.out,
                   RunFolderOptions{arguments.overwrite, "benchmark.json", known_entries(), {}});
  const InterruptWatch interrupt;
  const std::unique_ptr<ProgressSink> progress = make_progress(arguments.quiet);
  const BenchmarkResult result = run_benchmark(request, *progress, [&] { return interrupt.requested(); });
  if (folder) {
    write_benchmark(folder->path(), result);
    folder->commit();
  }
  std::cout << (arguments.json ? to_json(result) : to_table(result));
  if (result.partial) std::cerr << "stopped early: this is what was done so far\n";
  if (result.records.empty()) {
    std::cerr << "nothing ever touched the sensor: there is nothing to compare\n";
    throw CLI::RuntimeError(1);
  }
}

}  // namespace

void add_benchmark(CLI::App& lab) {
  const auto arguments = std::make_shared<BenchmarkArguments>();
  CLI::App* command =
      add_study(lab, "benchmark", "Compare registration methods over data with ground truth", arguments, run);
  command
      ->add_option("DATA", arguments->data,
                   "Data folders with true_start_T_currs.npy, or folders of such (TactileTracking as it is)")
      ->required();
  std::string known;
  for (const std::string& name : registrar_names()) known += (known.empty() ? "" : ", ") + name;
  add_list(*command, "--methods", arguments->methods, "Of: " + known)->capture_default_str();
  command
      ->add_option("--protocol", arguments->protocol,
                   "frame0: every frame against the first in contact, as published; keyframes: the tracker")
      ->check(CLI::IsMember({"frame0", "keyframes"}))
      ->capture_default_str();
  command->add_option("--every", arguments->every, "Only every Nth frame, where a method is slow")
      ->check(CLI::PositiveNumber)
      ->capture_default_str();
  command->add_option("--config", arguments->sources.config,
                      "Configuration (default: config.yaml of each trial)");
  command->add_option("--model", arguments->sources.model,
                      "Gradient model nnmodel.pth (default: the configuration's)");
  command->add_flag("--force", arguments->sources.force, "Go on although first frames seem to show contact");
  command->add_option("-o,--output", arguments->out, "Folder for benchmark.json and CSV tables");
  command->add_flag("--overwrite", arguments->overwrite, "Replace the folder if it is there");
  command->add_flag("--json", arguments->json, "Print JSON instead of a table");
  add_quiet_flag(*command, arguments->quiet);
  command->footer(
      "Example: gelslam-lab benchmark data/TactileTracking --methods normalflow,icp -o BENCH\n"
      "Pictures: scripts/plot_benchmark.py BENCH");
}

}  // namespace gelslam::lab
