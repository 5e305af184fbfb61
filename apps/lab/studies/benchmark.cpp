#include "protocols/benchmark.hpp"

#include <filesystem>
#include <iostream>
#include <memory>
#include <string>
#include <vector>

#include "baselines/baselines.hpp"
#include "study.hpp"

namespace gelslam::lab {
namespace {

constexpr const char* kAxes[] = {"x_mm", "y_mm", "z_mm", "rx_deg", "ry_deg", "rz_deg"};

struct BenchmarkArguments {
  std::vector<std::filesystem::path> data;
  std::vector<std::string> methods = {"normalflow", "icp", "fpfh", "filterreg"};
  std::string protocol = "frame0";
  int every = 1;
  std::filesystem::path out;
};

/// Runs all methods on the same frames of every trial.
BenchmarkResult run_benchmark(const BenchmarkArguments& arguments) {
  const std::vector<BenchmarkTrial> trials = find_trials(arguments.data);
  const Protocol protocol = arguments.protocol == "frame0" ? Protocol::frame0 : Protocol::keyframes;
  BenchmarkResult result;
  StudyCases cases(trials.size());
  for (const BenchmarkTrial& trial : trials) {
    cases.begin(trial.name);
    const std::unique_ptr<TrialFrames> frames = open_trial(trial.folder);
    const SlamOptions& options = frames->config().slam;
    std::vector<MethodRun> runs;
    for (const std::string& method : arguments.methods)
      runs.emplace_back(make_registrar(method, options.registration), protocol, options);
    for (int read = 0; const std::optional<TrialFrame> frame = frames->next(); ++read)
      if (read % arguments.every == 0)
        for (MethodRun& run : runs) run.add(*frame);
    for (std::size_t i = 0; i < runs.size(); ++i)
      if (!runs[i].estimates().empty())
        result.push_back({arguments.methods[i], trial.object, trial.name, runs[i].estimates()});
  }
  return result;
}

Json accuracy_table(const BenchmarkResult& result) {
  Json rows = Json::array();
  for (const AccuracyRow& row : accuracy_by_object(result)) {
    rows.push_back({{"object", row.object},
                    {"method", row.method},
                    {"trials", row.trials},
                    {"frames", row.frames},
                    {"tracked_share", row.tracked_share()}});
    for (int axis = 0; axis < 6; ++axis) rows.back()[kAxes[axis]] = row.mae[axis];
    rows.back().update({{"geometric_mean_mm", row.geometric_mean_mm},
                        {"final_mm", row.final_mm},
                        {"final_deg", row.final_deg},
                        {"median_ms", row.median_ms},
                        {"p95_ms", row.p95_ms}});
  }
  return rows;
}

void run(const BenchmarkArguments& arguments) {
  check_methods(arguments.methods);
  const BenchmarkResult result = run_benchmark(arguments);
  const Json table = accuracy_table(result);
  write_study(arguments.out, "accuracy", table);
  print_csv(table);
  if (result.empty()) {
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
  command->add_option("-o,--output", arguments->out, "Folder for accuracy.json");
  command->footer(
      "Example: gelslam-lab benchmark data/TactileTracking --methods normalflow,icp -o BENCH\n"
      "Pictures: scripts/plot_benchmark.py BENCH");
}

}  // namespace gelslam::lab
