// Study: what a method's "tracked" is worth. Every method answers hard and easy problems, generated ones and
// those of the sequences; every answer is written with its gates' values and its true error.

#include <algorithm>
#include <filesystem>
#include <iostream>
#include <iterator>
#include <limits>
#include <map>
#include <string>
#include <tuple>
#include <vector>

#include "answers.hpp"
#include "gelslam/core/error.hpp"
#include "gelslam/core/files.hpp"
#include "gelslam/registration/normal_flow.hpp"
#include "simulated_frames.hpp"
#include "stability_levels.hpp"
#include "study.hpp"

namespace gelslam::lab {
namespace {

namespace fs = std::filesystem;

Json to_json(const Answer& answer) {
  const Judgement& judged = answer.judgement;
  return {{"source", answer.source},
          {"where", answer.where},
          {"method", answer.method},
          {"tracked", judged.tracked},
          {"scr", answer.scr},
          {"ccs", answer.ccs},
          {"error_mm", judged.error_mm},
          {"error_deg", judged.error_deg},
          {"shown_error_mm", judged.shown_error_mm},
          {"shown_error_deg", judged.shown_error_deg},
          {"right", judged.right},
          {"shown_right", judged.shown_right},
          {"wrong", judged.wrong}};
}

/// By source ("generated", "frame 0", "keyframes") and method, in the order of `methods`.
Json summary(const std::vector<Answer>& answers, const std::vector<std::string>& methods) {
  std::map<std::pair<std::string, std::size_t>, Tally> tallies;
  for (const Answer& answer : answers) {
    const auto method = std::find(methods.begin(), methods.end(), answer.method) - methods.begin();
    tallies[{answer.source, static_cast<std::size_t>(method)}].add(answer.judgement);
  }
  Json rows = Json::array();
  for (const auto& [key, tally] : tallies)
    rows.push_back({{"source", key.first},
                    {"method", methods[key.second]},
                    {"answers", tally.cases},
                    {"tracked", tally.tracked},
                    {"silent_failures", tally.silent},
                    {"tracked_not_right", tally.tracked_not_right},
                    {"lost", tally.cases - tally.tracked},
                    {"lost_but_right", tally.lost_right}});
  return rows;
}

/// Where each method fails in silence: how often, and how badly at worst.
Json silent_failures(const std::vector<Answer>& answers) {
  std::map<std::tuple<std::string, std::string, std::string>, Json> found;
  for (const Answer& answer : answers) {
    if (!answer.judgement.silent_failure()) continue;
    Json& entry = found[{answer.method, answer.source, answer.where}];
    if (entry.is_null())
      entry = {{"method", answer.method}, {"source", answer.source}, {"where", answer.where}, {"times", 0},
               {"worst_mm", 0.0},         {"worst_deg", 0.0},        {"first", answer.name}};
    entry["times"] = entry["times"].get<int>() + 1;
    entry["worst_mm"] = std::max(entry["worst_mm"].get<double>(), answer.judgement.shown_error_mm);
    entry["worst_deg"] = std::max(entry["worst_deg"].get<double>(), answer.judgement.shown_error_deg);
  }
  Json rows = Json::array();
  for (const auto& [key, entry] : found) rows.push_back(entry);
  return rows;
}

/// The silent failures of one method.
Json only(const std::string& method, const Json& rows) {
  Json some = Json::array();
  for (const Json& row : rows)
    if (row["method"] == method) some.push_back(row);
  return some;
}

std::vector<Answer> ask_all(const TouchStudyArguments& arguments) {
  std::vector<fs::path> folders = arguments.data;
  const bool generated_only = arguments.simulated_only || !arguments.charts.empty();
  if (folders.empty() && !generated_only) folders = sequence_folders({"hard_", "track_"});
  std::vector<Answer> answers;
  const auto add = [&](std::vector<Answer> more) {
    answers.insert(answers.end(), std::make_move_iterator(more.begin()), std::make_move_iterator(more.end()));
  };
  StabilityChoice choice;
  if (arguments.quick) choice = {1, 1, false, {}};
  choice.charts = arguments.charts;
  TouchStudio studio(quickly_trained_model());
  const auto sink = [&](const StabilityLevel& level) {
    std::cerr << level.chart << " " << level.level << "\n";
    add(answers_to(level, arguments.methods));
  };
  simulated_levels(studio, choice, sink);
  trap_levels(studio, choice, sink);
  for (const fs::path& folder : folders) {
    std::cerr << name_of(folder) << "\n";
    add(answers_to(folder, arguments.quick ? 60 : std::numeric_limits<int>::max(), arguments.methods));
  }
  return answers;
}

void run(const TouchStudyArguments& arguments) {
  check_methods(arguments.methods);
  const std::vector<Answer> answers = ask_all(arguments);
  if (answers.empty()) throw Error("there is nothing to ask: of these charts none belongs to this study");
  const Json sums = summary(answers, arguments.methods), silent = silent_failures(answers);
  Json rows = Json::array();
  for (const Answer& answer : answers) rows.push_back(to_json(answer));
  const NormalFlowOptions limits;
  write_study(arguments.out, "honesty_answers", rows);
  write_study(arguments.out, "honesty", sums);
  write_study(arguments.out, "silent_failures", silent);
  write_study(arguments.out, "gates",
              Json::array({{{"scr", limits.curvature.min_scr}, {"ccs", limits.curvature.min_ccs}}}));
  print_table(sums);
  std::cout << "\nsilent failures of NormalFlow\n";
  print_table(only("normalflow", silent));
}

}  // namespace

void add_honesty(CLI::App& lab) {
  const auto arguments = std::make_shared<TouchStudyArguments>();
  CLI::App* command =
      add_study(lab, "honesty", "Count wrong answers that were called tracked, and right ones called lost",
                arguments, run);
  arguments->add_to(*command, "Data folders with truth (default: GELSLAM_DATA/sequences/hard_* and track_*)",
                    "Only these generated problems, and no sequences but those named (default: all)",
                    "Few generated problems, 60 frames of each sequence",
                    "Folder for honesty, honesty_answers, silent_failures and gates, each .csv and .json");
  command->footer("Example: gelslam-lab honesty --quick -o STUDY && scripts/plot_honesty.py STUDY");
}

}  // namespace gelslam::lab
