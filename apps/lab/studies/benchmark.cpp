#include <fmt/core.h>

#include <algorithm>
#include <array>
#include <filesystem>
#include <iostream>
#include <memory>
#include <string>
#include <vector>

#include "baselines/baselines.hpp"
#include "gelslam/core/files.hpp"
#include "gelslam/core/process.hpp"
#include "protocols/report.hpp"
#include "study.hpp"
#include "terminal_progress.hpp"

namespace gelslam::lab {
namespace {

constexpr std::array<const char*, 6> kAxes = {"x_mm", "y_mm", "z_mm", "rx_deg", "ry_deg", "rz_deg"};

struct BenchmarkArguments {
  std::vector<std::filesystem::path> data;
  std::vector<std::string> methods = {"normalflow", "icp", "fpfh", "filterreg"};
  std::string protocol = "frame0";
  int every = 1;
  TrialSources sources;
  std::filesystem::path out;
  bool quiet = false;
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

Json accuracy_table(const BenchmarkResult& result) {
  Json rows = Json::array();
  for (const AccuracyRow& row : accuracy_by_object(result)) {
    rows.push_back({{"object", row.object},
                    {"method", row.method},
                    {"trials", row.trials},
                    {"frames", row.frames},
                    {"tracked_share", row.tracked_share()}});
    for (std::size_t axis = 0; axis < 6; ++axis) rows.back()[kAxes[axis]] = row.mae[axis];
    rows.back().update({{"geometric_mean_mm", row.geometric_mean_mm},
                        {"final_mm", row.final_mm},
                        {"final_deg", row.final_deg},
                        {"median_ms", row.median_ms},
                        {"p95_ms", row.p95_ms}});
  }
  return rows;
}

/// Every frame of every method: too many for a table in memory.
std::string frames_csv(const BenchmarkResult& result) {
  std::string text = "method,object,trial,frame,time_s,tracked,cpu_ms";
  for (const std::string prefix : {"", "true_"})
    for (const char* axis : kAxes) text += "," + prefix + axis;
  text += "\n";
  for (const BenchmarkRecord& record : result.records) {
    const std::string names =
        csv_cell(record.method) + "," + csv_cell(record.object) + "," + csv_cell(record.trial);
    for (const FrameEstimate& frame : record.frames) {
      text += names + fmt::format(",{},{:.6f},{},{:.6g}", frame.frame, frame.time_s, frame.tracked ? 1 : 0,
                                  frame.cpu_ms);
      for (const Pose& pose : {frame.first_T_frame, frame.true_first_T_frame})
        for (const double value : six_axes(pose)) text += fmt::format(",{:.6g}", value);
      text += "\n";
    }
  }
  return text;
}

void run(const BenchmarkArguments& arguments) {
  const BenchmarkRequest request = request_of(arguments);
  const InterruptWatch interrupt;
  const std::unique_ptr<ProgressSink> progress = make_progress(arguments.quiet);
  const BenchmarkResult result = run_benchmark(request, *progress, [&] { return interrupt.requested(); });
  const Json table = accuracy_table(result);
  if (!arguments.out.empty()) {
    write_study(arguments.out, "accuracy", table);
    write_file_atomically(arguments.out / "frames.csv", frames_csv(result));
  }
  print_table(table);
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
  command->add_option("-o,--output", arguments->out, "Folder for accuracy (CSV and JSON) and frames.csv");
  add_quiet_flag(*command, arguments->quiet);
  command->footer(
      "Example: gelslam-lab benchmark data/TactileTracking --methods normalflow,icp -o BENCH\n"
      "Pictures: scripts/plot_benchmark.py BENCH");
}

}  // namespace gelslam::lab
