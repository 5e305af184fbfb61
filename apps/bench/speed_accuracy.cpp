// Study: speed against accuracy. Every method, and every setting that trades one for the other, registers the
// same pairs of frames of sequences with truth. Printed: processor time (median) and error (geometric mean of
// the six mean absolute errors, a degree counted as 0.087 mm), and whether no other setting is both faster
// and better.

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <iostream>
#include <map>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "gelslam/benchmark/report.hpp"
#include "gelslam/core/error.hpp"
#include "gelslam/core/median.hpp"
#include "gelslam/evaluation/trajectory_metrics.hpp"
#include "judgement.hpp"
#include "registration_problems.hpp"
#include "speed_settings.hpp"
#include "study_command.hpp"
#include "study_files.hpp"

namespace gelslam::bench {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::ordered_json;

struct Arguments {
  std::vector<fs::path> data;
  std::vector<std::string> methods = {"normalflow", "icp", "filterreg", "fpfh"};
  ProblemChoice choice;
  fs::path out;
};

/// What was measured of one setting.
struct Measured {
  SpeedSetting setting;
  std::vector<double> register_ms, prepare_ms, surface_ms;
  SixAxes error_sum{};
  int problems = 0, tracked = 0, right = 0;

  double share(int count) const { return problems == 0 ? 0 : static_cast<double>(count) / problems; }
  SixAxes mae() const {
    SixAxes mean = error_sum;
    for (double& error : mean) error /= std::max(1, problems);
    return mean;
  }
  double error_mm() const {
    double product = 1;
    const SixAxes mean = mae();
    for (std::size_t axis = 0; axis < 6; ++axis)
      product *= mean[axis] * (axis < 3 ? 1.0 : kMillimetresPerDegree);
    return std::pow(product, 1.0 / 6.0);
  }
};

void judge(const RegistrationProblem& problem, const RegistrationResult& result, Measured& measured) {
  FrameEstimate estimate;
  estimate.first_T_frame = result.target_T_reference.inverse();
  estimate.true_first_T_frame = problem.truth.inverse();
  const SixAxes error = axis_error(estimate);
  for (std::size_t axis = 0; axis < 6; ++axis) measured.error_sum[axis] += std::abs(error[axis]);
  ++measured.problems;
  measured.tracked += result.ok() ? 1 : 0;
  measured.right += judge_result(problem, result).right ? 1 : 0;
}

void measure(const ProblemSet& set, Measured& measured) {
  std::vector<std::shared_ptr<const PreparedReference>> references;
  for (const SurfacePtr& surface : set.references) {
    const double start_ms = thread_cpu_ms();
    references.push_back(measured.setting.registrar->prepare(surface));
    measured.prepare_ms.push_back(thread_cpu_ms() - start_ms);
  }
  for (const RegistrationProblem& problem : set.problems) {
    const double start_ms = thread_cpu_ms();
    const RegistrationResult result =
        references[problem.reference]->register_to(*problem.target, problem.start);
    measured.register_ms.push_back(thread_cpu_ms() - start_ms);
    judge(problem, result, measured);
  }
  measured.surface_ms.insert(measured.surface_ms.end(), set.surface_ms.begin(), set.surface_ms.end());
}

/// By resolution and folder, so that only one set of surfaces is held at once.
std::vector<Measured> measure_all(const Arguments& arguments) {
  std::vector<Measured> all;
  std::map<std::pair<int, int>, std::vector<std::size_t>> by_size;
  for (SpeedSetting& setting : speed_settings(arguments.methods)) {
    by_size[{setting.size.width, setting.size.height}].push_back(all.size());
    all.push_back({std::move(setting), {}, {}, {}, {}});
  }
  for (const auto& [size, indices] : by_size) {
    for (const fs::path& folder : arguments.data) {
      std::cerr << size.first << "x" << size.second << " " << folder.filename().string() << "\n";
      const ProblemSet set = load_problems(folder, {size.first, size.second}, arguments.choice);
      Measured warm_up = all[indices.front()];  // whoever came first would pay for cold pages and caches
      measure(set, warm_up);
      for (const std::size_t index : indices) measure(set, all[index]);
    }
  }
  return all;
}

/// Nothing else is at least as good in both and better in one.
bool on_front(const std::vector<Measured>& all, const Measured& one) {
  const double ms = median(one.register_ms), mm = one.error_mm();
  return std::none_of(all.begin(), all.end(), [&](const Measured& other) {
    const double other_ms = median(other.register_ms), other_mm = other.error_mm();
    return other_ms <= ms && other_mm <= mm && (other_ms < ms || other_mm < mm);
  });
}

Json to_json(const std::vector<Measured>& all) {
  Json rows = Json::array();
  for (const Measured& one : all) {
    Json row = {{"method", one.setting.method},         {"knob", one.setting.knob},
                {"value", one.setting.value},           {"width_px", one.setting.size.width},
                {"height_px", one.setting.size.height}, {"problems", one.problems},
                {"median_ms", median(one.register_ms)}, {"prepare_ms", median(one.prepare_ms)},
                {"surface_ms", median(one.surface_ms)}, {"error_mm", one.error_mm()}};
    constexpr std::array<const char*, 6> axes = {"x_mm", "y_mm", "z_mm", "rx_deg", "ry_deg", "rz_deg"};
    const SixAxes mae = one.mae();
    for (std::size_t axis = 0; axis < 6; ++axis) row[axes[axis]] = mae[axis];
    row["right_share"] = one.share(one.right);
    row["tracked_share"] = one.share(one.tracked);
    row["on_front"] = on_front(all, one);
    rows.push_back(row);
  }
  return rows;
}

void print_table(const Json& rows) {
  std::printf("%-11s %-34s %-8s %9s %9s %7s %7s %7s %7s %7s %7s %9s %6s %6s\n", "method", "setting", "value",
              "ms", "prepare", "x mm", "y mm", "z mm", "rx deg", "ry deg", "rz deg", "error mm", "right",
              "front");
  for (const Json& r : rows)
    std::printf("%-11s %-34s %-8s %9.3f %9.3f %7.4f %7.4f %7.4f %7.3f %7.3f %7.3f %9.5f %6.3f %6s\n",
                r["method"].get<std::string>().c_str(), r["knob"].get<std::string>().c_str(),
                r["value"].get<std::string>().c_str(), r["median_ms"].get<double>(),
                r["prepare_ms"].get<double>(), r["x_mm"].get<double>(), r["y_mm"].get<double>(),
                r["z_mm"].get<double>(), r["rx_deg"].get<double>(), r["ry_deg"].get<double>(),
                r["rz_deg"].get<double>(), r["error_mm"].get<double>(), r["right_share"].get<double>(),
                r["on_front"].get<bool>() ? "*" : "");
}

void run(Arguments arguments) {
  if (arguments.data.empty()) arguments.data = sequence_folders({"track_"});
  const Json rows = to_json(measure_all(arguments));
  if (rows.empty()) throw Error("none of the methods is known: normalflow, icp, filterreg, fpfh");
  if (!arguments.out.empty()) write_study(arguments.out, "speed_accuracy", rows);
  print_table(rows);
}

}  // namespace
}  // namespace gelslam::bench

int main(int argc, char** argv) {
  gelslam::bench::Arguments arguments;
  CLI::App app{"Time against error of every registration method and setting", "speed_accuracy"};
  app.add_option("DATA", arguments.data, "data folders with truth (default: GELSLAM_DATA/sequences/track_*)");
  app.add_option("--methods", arguments.methods, "normalflow, icp, filterreg, fpfh")
      ->delimiter(',')
      ->allow_extra_args(false);
  app.add_option("--stride", arguments.choice.stride, "frames between references")
      ->check(CLI::PositiveNumber)
      ->capture_default_str();
  app.add_option("--gaps", arguments.choice.gaps, "frames from a reference to its targets")
      ->delimiter(',')
      ->allow_extra_args(false)
      ->check(CLI::PositiveNumber);
  app.add_option("-o,--output", arguments.out, "folder for speed_accuracy.csv and .json");
  return gelslam::bench::run_study(app, argc, argv, [&] { gelslam::bench::run(arguments); });
}
