// Study: limits of each registration method. Reported are the rate of success (within 0.3 mm and 2 degrees of
// the truth) as a function of the size of the motion, overlap, noise, texture, depth, light, dirt and missing
// frames, and how often a wrong pose is accepted.

#include <algorithm>
#include <filesystem>
#include <iostream>
#include <map>
#include <string>
#include <tuple>
#include <vector>

#include "baselines/baselines.hpp"
#include "judgement.hpp"
#include "simulated_frames.hpp"
#include "stability_levels.hpp"
#include "study.hpp"

namespace gelslam::lab {
namespace {

namespace fs = std::filesystem;

struct StabilityArguments {
  std::vector<fs::path> data;
  std::vector<std::string> methods = {"normalflow",      "icp", "icp-tuned", "filterreg",
                                      "filterreg-tuned", "fpfh"};
  bool quick = false;
  fs::path out;
};

/// Returns a method's results for all problems of a level. FPFH, which uses no initial pose and is slow, gets
/// only every second pair of surfaces, and is left out where the initial pose is varied.
Tally tally_of(const StabilityLevel& level, const std::string& method) {
  const bool is_slow = method.starts_with("fpfh");
  Tally tally;
  if (is_slow && is_basin(level.chart)) return tally;
  const Registrar prepare = make_registrar(method, NormalFlowOptions{});
  std::vector<PreparedReference> prepared(level.set.references.size());
  for (const RegistrationProblem& problem : level.set.problems) {
    if (is_slow && (problem.start_number > 0 || problem.reference % 2 != 0)) continue;
    auto& reference = prepared[problem.reference];
    if (!reference.samples) reference = prepare(level.set.references[problem.reference]);
    tally.add(judge_result(problem, reference.register_to(*problem.target, problem.start)));
  }
  return tally;
}

/// Collects the results of all levels of all charts, in order.
class Study {
 public:
  explicit Study(std::vector<std::string> methods) : methods_(std::move(methods)) {}

  void add(const StabilityLevel& level) {
    std::cerr << level.chart << " " << level.level << "\n";
    const auto known = std::find(charts_.begin(), charts_.end(), level.chart);
    const auto chart = static_cast<std::size_t>(known - charts_.begin());
    if (known == charts_.end()) charts_.push_back(level.chart);
    for (std::size_t method = 0; method < methods_.size(); ++method)
      if (const Tally tally = tally_of(level, methods_[method]); tally.cases > 0)
        tallies_[{chart, level.level, method}].add(tally);
  }

  Json rows() const {
    Json rows = Json::array();
    for (const auto& [key, tally] : tallies_) {
      const auto& [chart, level, method] = key;
      rows.push_back({{"chart", charts_[chart]},
                      {"level", level},
                      {"method", methods_[method]},
                      {"cases", tally.cases},
                      {"right", tally.share(tally.right)},
                      {"right_where_shown", tally.share(tally.shown_right)},
                      {"tracked", tally.share(tally.tracked)},
                      {"silent_failures", tally.share(tally.undetected)}});
    }
    return rows;
  }

 private:
  std::vector<std::string> methods_, charts_;
  // Indexed by chart, level and method.
  std::map<std::tuple<std::size_t, double, std::size_t>, Tally> tallies_;
};

void run(const StabilityArguments& arguments) {
  check_methods(arguments.methods);
  Study study(arguments.methods);
  TouchStudio studio(flat_sensor_model());
  const auto sink = [&](const StabilityLevel& level) {
    study.add(level);
    write_study(arguments.out, "stability", study.rows());
  };
  simulated_levels(studio, arguments.quick ? 1 : TouchSpec::kPlaces, sink);
  missing_frame_levels(arguments.data, sink);
  print_csv(study.rows());
}

}  // namespace

void add_stability(CLI::App& lab) {
  const auto arguments = std::make_shared<StabilityArguments>();
  CLI::App* command = add_study(
      lab, "stability", "Measure the success rate of each method against what makes registration hard",
      arguments, run);
  command->add_option("DATA", arguments->data, "Data folders with truth, for the chart of missing frames");
  add_list(*command, "--methods", arguments->methods,
           "normalflow, icp, fpfh, filterreg; -tuned for their best settings");
  command->add_flag("--quick", arguments->quick, "One place of each object");
  command->add_option("-o,--output", arguments->out, "Folder for stability.json");
  command->footer(
      "Example: gelslam-lab stability DATA/sequences/track_* -o STUDY && scripts/plot_stability.py STUDY");
}

}  // namespace gelslam::lab
