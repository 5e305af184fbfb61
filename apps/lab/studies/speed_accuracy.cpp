// Study: speed and accuracy. Every method, with every setting that trades one for the other, registers the
// same pairs of frames of sequences with ground truth. Reported: median processor time, error, the confidence
// that this error differs from that of our default, and whether no other setting is both faster and better.

#include "speed_accuracy.hpp"

#include <algorithm>
#include <filesystem>
#include <string>
#include <vector>

#include "gelslam/core/error.hpp"
#include "gelslam/core/files.hpp"
#include "gelslam/core/median.hpp"
#include "judgement.hpp"
#include "registration_problems.hpp"
#include "study.hpp"

namespace gelslam::lab {
namespace {

namespace fs = std::filesystem;

// A registration that takes longer is timed only once, as caches hardly matter.
constexpr double kSlowMs = 5;

struct SpeedAccuracyArguments {
  std::vector<fs::path> data;
  std::vector<std::string> methods = {"normalflow", "icp", "filterreg", "fpfh"};
  ProblemChoice choice{.stride = 24, .gaps = {1, 5, 12}, .most_references = 24};
  int slow_every = 4;  // Methods other than NormalFlow get only every n-th reference.
  fs::path out;
};

/// Measurements of one setting.
struct Measured {
  SpeedSetting setting;
  int every = 1;  ///< It gets every n-th reference.
  std::vector<double> register_ms, prepare_ms;
  GroupedErrors errors;
  Tally tally = {};
};

void judge(const RegistrationProblem& problem, const RegistrationResult& result, Measured& measured) {
  const Vector6d error = axis_error(result.target_T_reference.inverse(), problem.truth.inverse());
  measured.errors.back()[problem.reference].push_back(error.cwiseAbs());
  measured.tally.add(judge_result(problem, result));
}

/// Registers twice and takes the second time, because in a stream the data of keyframe and surface are
/// already in the caches.
RegistrationResult register_timed(const PreparedReference& reference, const RegistrationProblem& problem,
                                  std::vector<double>& times_ms) {
  const auto once = [&](double& ms) {
    const double start_ms = thread_cpu_ms();
    RegistrationResult result = reference.register_to(*problem.target, problem.start);
    ms = thread_cpu_ms() - start_ms;
    return result;
  };
  double ms = 0;
  RegistrationResult result = once(ms);
  if (ms < kSlowMs) once(ms);
  times_ms.push_back(ms);
  return result;
}

/// Measures one setting on one reference.
void measure(const ProblemSet& set, std::size_t reference, Measured& one) {
  const double start_ms = thread_cpu_ms();
  const PreparedReference prepared = one.setting.registrar(set.references[reference]);
  one.prepare_ms.push_back(thread_cpu_ms() - start_ms);
  for (const RegistrationProblem& problem : set.problems)
    if (problem.reference == reference)
      judge(problem, register_timed(prepared, problem, one.register_ms), one);
}

/// All settings take turns at each reference, so that other load on the computer affects all of them alike.
void measure(const ProblemSet& set, std::vector<Measured>& all) {
  for (Measured& one : all) one.errors.emplace_back(set.references.size());
  for (std::size_t k = 0; k < set.references.size(); ++k) {
    // Otherwise the first setting would be slowed down by cold pages and caches.
    Measured warm_up = all.front();
    measure(set, k, warm_up);
    for (Measured& one : all)
      if (k % static_cast<std::size_t>(one.every) == 0) measure(set, k, one);
  }
}

/// Processes one folder after another, so that only one set of surfaces is in memory. `done` is called with
/// the results after each folder.
template <class Done>
std::vector<Measured> measure_all(const SpeedAccuracyArguments& arguments, const Done& done) {
  std::vector<Measured> all;
  for (SpeedSetting& setting : speed_settings(arguments.methods)) {
    const int every = setting.method == "normalflow" ? 1 : arguments.slow_every;
    all.push_back({std::move(setting), every, {}, {}, {}});
  }
  StudyCases cases(arguments.data.size());
  for (const fs::path& folder : arguments.data) {
    cases.begin(name_of(folder));
    measure(load_problems(folder, arguments.choice), all);
    done(all);
  }
  return all;
}

std::vector<ParetoStanding> standings_of(const std::vector<Measured>& all) {
  std::vector<ParetoCandidate> candidates;
  candidates.reserve(all.size());
  for (const Measured& one : all) candidates.push_back({median(one.register_ms), one.errors});
  return pareto_standings(candidates, 0);  // The first one is the default of the first method.
}

Json to_json(const std::vector<Measured>& all) {
  Json rows = Json::array();
  const std::vector<ParetoStanding> standings = standings_of(all);
  for (std::size_t k = 0; k < all.size(); ++k) {
    const Measured& one = all[k];
    const ParetoStanding& standing = standings[k];
    Json row = {{"method", one.setting.method},
                {"knob", one.setting.knob},
                {"value", one.setting.value},
                {"problems", one.tally.cases},
                {"median_ms", median(one.register_ms)},
                {"prepare_ms", median(one.prepare_ms)},
                {"error_mm", standing.error_mm},
                {"relative", standing.relative},
                {"relative_low", standing.relative_low},
                {"relative_high", standing.relative_high}};
    row["right_share"] = one.tally.share(one.tally.right);
    row["tracked_share"] = one.tally.share(one.tally.tracked);
    row["on_front"] = standing.on_front;
    rows.push_back(row);
  }
  return rows;
}

void run(const SpeedAccuracyArguments& arguments) {
  const std::vector<Measured> all = measure_all(arguments, [&](const std::vector<Measured>& so_far) {
    write_study(arguments.out, "speed_accuracy", to_json(so_far));
  });
  if (all.empty()) throw Error("none of the methods is known: normalflow, icp, filterreg, fpfh");
  if (all.front().tally.cases == 0) throw Error("no two frames of the data touch and lie so far apart");
  print_csv(to_json(all));
}

}  // namespace

void add_speed_accuracy(CLI::App& lab) {
  const auto arguments = std::make_shared<SpeedAccuracyArguments>();
  CLI::App* command =
      add_study(lab, "speed-accuracy", "Measure time against error of every registration method and setting",
                arguments, run);
  command->add_option("DATA", arguments->data, "Data folders with truth")->required();
  add_list(*command, "--methods", arguments->methods, "normalflow, icp, filterreg, fpfh");
  command
      ->add_option("--most-references", arguments->choice.most_references,
                   "Limit per sequence, spread evenly")
      ->check(CLI::PositiveNumber)
      ->capture_default_str();
  command
      ->add_option("--slow-every", arguments->slow_every,
                   "Methods other than normalflow see every Nth reference")
      ->check(CLI::PositiveNumber)
      ->capture_default_str();
  command->add_option("-o,--output", arguments->out, "Folder for speed_accuracy.json");
  command->footer(
      "Example: gelslam-lab speed-accuracy DATA/sequences/track_* --slow-every 12 -o STUDY && "
      "scripts/plot_speed_accuracy.py STUDY");
}

}  // namespace gelslam::lab
