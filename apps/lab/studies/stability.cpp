// Study: where each method breaks. Success (within 0.3 mm and 2 degrees of the truth) of every registration
// method against the size of the motion, overlap, noise, texture, depth, light, dirt and missing frames.

#include <algorithm>
#include <filesystem>
#include <iostream>
#include <map>
#include <string>
#include <tuple>
#include <vector>

#include "answers.hpp"
#include "gelslam/core/error.hpp"
#include "simulated_frames.hpp"
#include "stability_levels.hpp"
#include "study.hpp"

namespace gelslam::lab {
namespace {

namespace fs = std::filesystem;

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

void run(const TouchStudyArguments& arguments) {
  check_methods(arguments.methods);
  Study study(arguments.methods);
  std::vector<fs::path> folders = arguments.data;
  if (folders.empty() && !arguments.simulated_only) folders = sequence_folders({"track_"});
  StabilityChoice choice;
  if (arguments.quick) choice = {1, 1, false, {}};
  choice.charts = arguments.charts;
  TouchStudio studio(quickly_trained_model());
  const auto sink = [&](const StabilityLevel& level) {
    study.add(level);
    write_study(arguments.out, "stability", study.rows());
  };
  simulated_levels(studio, choice, sink);
  missing_frame_levels(folders, choice, sink);
  const Json rows = study.rows();
  if (rows.empty()) throw Error("there is nothing to measure: of these charts none belongs to this study");
  print_table(rows);
}

}  // namespace

void add_stability(CLI::App& lab) {
  const auto arguments = std::make_shared<TouchStudyArguments>();
  CLI::App* command = add_study(
      lab, "stability", "Measure the success rate of each method against what makes registration hard",
      arguments, run);
  arguments->add_to(*command,
                    "Data folders with truth, for missing frames (default: GELSLAM_DATA/sequences/track_*)",
                    "Only these (default: all)", "One place of each object, every second level",
                    "Folder for stability.csv and .json");
  command->footer("Example: gelslam-lab stability -o STUDY && scripts/plot_stability.py STUDY");
}

}  // namespace gelslam::lab
