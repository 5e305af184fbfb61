// Study: where each method breaks. Success (within 0.3 mm and 2 degrees of the truth) of every registration
// method against the size of the motion, overlap, noise, texture, depth, light, dirt and missing frames.

#include <algorithm>
#include <cstdio>
#include <filesystem>
#include <iostream>
#include <map>
#include <nlohmann/json.hpp>
#include <string>
#include <tuple>
#include <vector>

#include "answers.hpp"
#include "gelslam/baselines/baselines.hpp"
#include "gelslam/core/error.hpp"
#include "simulated_frames.hpp"
#include "stability_levels.hpp"
#include "study_command.hpp"
#include "study_files.hpp"

namespace gelslam::bench {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::ordered_json;

struct Tally {
  int cases = 0, right = 0, shown_right = 0, tracked = 0, silent = 0, lost_right = 0;

  void add(const Judgement& judgement) {
    ++cases;
    right += judgement.right ? 1 : 0;
    shown_right += judgement.shown_right ? 1 : 0;
    tracked += judgement.tracked ? 1 : 0;
    silent += judgement.silent_failure() ? 1 : 0;
    lost_right += !judgement.tracked && judgement.right ? 1 : 0;
  }
  double share(int count) const { return static_cast<double>(count) / std::max(1, cases); }
};

/// Of all levels of all charts, in the order in which they came.
class Study {
 public:
  explicit Study(std::vector<std::string> methods) : methods_(std::move(methods)) {}

  void add(const StabilityLevel& level) {
    std::cerr << level.chart << " " << level.level << "\n";
    const auto chart = place_of(charts_, level.chart);
    if (chart == charts_.size()) charts_.push_back(level.chart);
    for (const Answer& answer : answers_to(level, methods_))
      tallies_[{chart, level.level, place_of(methods_, answer.method)}].add(answer.judgement);
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
                      {"silent_failures", tally.share(tally.silent)},
                      {"lost_but_right", tally.share(tally.lost_right)}});
    }
    return rows;
  }

 private:
  static std::size_t place_of(const std::vector<std::string>& names, const std::string& name) {
    return static_cast<std::size_t>(std::find(names.begin(), names.end(), name) - names.begin());
  }

  std::vector<std::string> methods_, charts_;
  std::map<std::tuple<std::size_t, double, std::size_t>, Tally> tallies_;  // chart, level, method
};

void print_table(const Json& rows) {
  std::printf("%-15s %7s %-16s %6s %6s %7s %7s %7s %10s\n", "chart", "level", "method", "cases", "right",
              "shown", "tracked", "silent", "lost right");
  for (const Json& r : rows)
    std::printf("%-15s %7g %-16s %6d %6.2f %7.2f %7.2f %7.2f %10.2f\n", r["chart"].get<std::string>().c_str(),
                r["level"].get<double>(), r["method"].get<std::string>().c_str(), r["cases"].get<int>(),
                r["right"].get<double>(), r["right_where_shown"].get<double>(), r["tracked"].get<double>(),
                r["silent_failures"].get<double>(), r["lost_but_right"].get<double>());
}

void run(const TouchStudyArguments& arguments) {
  for (const std::string& method : arguments.methods)
    make_registrar(method, {});  // a misspelling is told at once
  Study study(arguments.methods);
  std::vector<fs::path> folders = arguments.data;
  if (folders.empty() && !arguments.simulated_only) folders = sequence_folders({"track_"});
  StabilityChoice choice;
  if (arguments.quick) choice = {1, 1, false, {}};
  choice.charts = arguments.charts;
  TouchStudio studio(quickly_trained_model());
  const auto sink = [&](const StabilityLevel& level) {
    study.add(level);
    if (!arguments.out.empty())
      write_study(arguments.out, "stability", study.rows());  // long: what is done is kept
  };
  simulated_levels(studio, choice, sink);
  missing_frame_levels(folders, choice, sink);
  const Json rows = study.rows();
  if (rows.empty()) throw Error("there is nothing to measure: of these charts none belongs to this study");
  print_table(rows);
}

}  // namespace
}  // namespace gelslam::bench

int main(int argc, char** argv) {
  gelslam::bench::TouchStudyArguments arguments;
  CLI::App app{"Success of every registration method against what makes it hard", "stability"};
  arguments.add_to(app,
                   "data folders with truth, for missing frames (default: GELSLAM_DATA/sequences/track_*)",
                   "only these (default: all)", "one place of each object, every second level",
                   "folder for stability.csv and .json");
  return gelslam::bench::run_study(app, argc, argv, [&] { gelslam::bench::run(arguments); });
}
