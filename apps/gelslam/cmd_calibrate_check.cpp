#include <fmt/core.h>

#include <opencv2/core.hpp>

#include "calibrate_commands.hpp"
#include "command_line.hpp"
#include "commands.hpp"
#include "gelslam/calibration/ball_zones.hpp"
#include "gelslam/calibration/model_check.hpp"
#include "gelslam/core/error.hpp"
#include "gelslam/core/text.hpp"
#include "gelslam/surface/background_drift.hpp"
#include "gelslam/surface/model_file.hpp"
#include "terminal_progress.hpp"

namespace gelslam {
namespace {

namespace fs = std::filesystem;

struct CheckArguments {
  PressOptions presses;
  fs::path model;
};

void print_for_people(const ModelCheck& check, const std::vector<std::string>& findings) {
  fmt::print("{}\n", verdict_name(check.verdict));
  for (const std::string& reason : check.reasons) fmt::print("  {}\n", reason);
  fmt::print("slope error {:.2f} degrees on {} presses; gradient scale (read over true) x {:.3f}, y {:.3f}\n",
             check.slopes.all.mean_abs_error_deg(), check.presses.size(), check.slopes.all.scale_x(),
             check.slopes.all.scale_y());
  for (const DiameterCheck& ball : check.diameters)
    fmt::print("ball of {:.2f} mm: median radius {:.3f} mm ({:+.1f} %) over {} presses\n", ball.diameter_mm,
               ball.median_radius_mm, 100.0 * ball.radius_error(), ball.presses);
  for (const std::string& finding : findings) fmt::print("{}\n", finding);
}

/// Throws Error when red and blue have been exchanged since the model was made.
std::string drift_since(const CalibrationRecord& record, const PressSet& set) {
  const BackgroundDrift drift = measure_drift(record.background_cells, background_cells(set.background));
  if (!drift.exchanged.empty()) throw Error(quoted(set.folder) + ": " + drift.words);
  return drift.words;  // The check of the presses shows whether it matters.
}

bool is_trained_on(const CalibrationRecord& record, const PressSet& set, const ModelCheck& check) {
  constexpr double kRoundingLevels = 0.01;
  return record.presses == std::ssize(check.presses) &&
         cv::norm(record.background_cells, background_cells(set.background), cv::NORM_INF) < kRoundingLevels;
}

int run_check(CheckArguments& arguments) {
  if (std::filesystem::is_directory(arguments.model) &&
      std::filesystem::is_regular_file(arguments.presses.folder))
    throw Error("'" + arguments.model.string() + "' is a folder, and '" + arguments.presses.folder.string() +
                "' a file: the model comes first, then the presses");
  StoppableProgress progress(arguments.presses.quiet);
  const ModelFile file = read_model_file(arguments.model);
  const PressSet set = read_presses(arguments.presses, file);
  std::vector<std::string> findings = {"optics: " + optics_text(*set.optics)};
  if (file.record) findings.push_back(drift_since(*file.record, set));
  const auto show = [&](std::size_t done) { progress.update(static_cast<std::int64_t>(done)); };
  progress.begin("looking at presses", std::ssize(set.presses));
  const BallZones zones = find_ball_zones(set, arguments.presses.pitch_mm, /*automatic=*/true, show);
  progress.end();
  for (const RejectedPress& press : zones.rejected)
    print_line("left out: " + set.presses[press.press].name + ": " + press.reason);
  progress.begin("checking", std::ssize(zones.zones));
  ModelCheck check = check_model({&file.model, 1}, set, zones.zones, arguments.presses.pitch_mm, show);
  progress.end();
  check.add_warning(zones.warning);
  if (file.record && is_trained_on(*file.record, set, check))
    findings.emplace_back(
        "these seem to be the presses that the model was trained on, which cannot judge it");
  print_for_people(check, findings);
  return check.verdict == Verdict::recalibrate ? kExitNotGood : kExitDone;
}

}  // namespace

void add_calibrate_check_command(CLI::App& calibrate, int& exit_code) {
  CLI::App* command = calibrate.add_subcommand("check", "Judge a model on presses of balls");
  auto& arguments = options_of(*command, exit_code, run_check);
  command->add_option("MODEL", arguments.model, "Model to judge (ours or nnmodel.pth)")->required();
  arguments.presses.add_to(*command);
  command->footer(
      "Presses without a label are labeled automatically. Prints good, usable or recalibrate, and why.\n"
      "Use presses that the model was not trained on. Exit code 1: recalibrate.\n"
      "Example: gelslam calibrate check model.json PRESSES");
}

}  // namespace gelslam
