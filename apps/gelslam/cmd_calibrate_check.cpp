#include <fmt/core.h>

#include <cmath>
#include <iostream>
#include <memory>
#include <nlohmann/json.hpp>

#include "calibrate_commands.hpp"
#include "command_line.hpp"
#include "commands.hpp"
#include "gelslam/calibration/background_drift.hpp"
#include "gelslam/calibration/model_check.hpp"
#include "gelslam/core/error.hpp"
#include "gelslam/core/text.hpp"
#include "gelslam/surface/model_file.hpp"
#include "terminal_progress.hpp"

namespace gelslam {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::ordered_json;

struct CheckArguments {
  PressOptions presses;
  fs::path model;
  bool json = false;
};

Json finite(double value) { return std::isfinite(value) ? Json(value) : Json(nullptr); }

Json scales_to_json(const ModelCheck& check) {
  Json ninths = Json::array();
  for (std::size_t k = 0; k < 9; ++k) {
    const SlopeSums& ninth = check.slopes.ninths[k];
    ninths.push_back(
        {{"gain_x", finite(ninth.scale_x())}, {"gain_y", finite(ninth.scale_y())}, {"pixels", ninth.pixels}});
  }
  return {{"x", finite(check.slopes.all.scale_x())},
          {"y", finite(check.slopes.all.scale_y())},
          {"ninths", std::move(ninths)}};
}

Json to_json(const ModelCheck& check, const std::vector<std::string>& findings, const PressSet& set,
             const BallZones& zones) {
  Json json = {{"verdict", verdict_name(check.verdict)},
               {"reasons", check.reasons},
               {"findings", findings},
               {"slope_error_deg", finite(check.slopes.all.mean_abs_error_deg())},
               {"gain", scales_to_json(check)},
               {"balls", Json::array()},
               {"presses", Json::array()},
               {"left_out", Json::array()}};
  for (const DiameterCheck& ball : check.diameters)
    json["balls"].push_back({{"diameter_mm", ball.diameter_mm},
                             {"presses", ball.presses},
                             {"median_radius_mm", ball.median_radius_mm},
                             {"radius_error_percent", 100.0 * ball.radius_error()}});
  for (const PressCheck& press : check.presses)
    json["presses"].push_back({{"name", set.presses[press.zone.press].name},
                               {"diameter_mm", set.presses[press.zone.press].diameter_mm},
                               {"center_px", {press.zone.u_px, press.zone.v_px}},
                               {"zone_radius_px", press.zone.radius_px},
                               {"slope_error_deg", press.mean_abs_error_deg},
                               {"radius_mm", press.radius_mm ? Json(*press.radius_mm) : Json(nullptr)}});
  for (const RejectedPress& press : zones.rejected)
    json["left_out"].push_back({{"name", set.presses[press.press].name}, {"reason", press.reason}});
  return json;
}

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

/// Throws Error when red and blue have changed places since the model was made.
std::string drift_since(const CalibrationRecord& record, const PressSet& set) {
  const BackgroundDrift drift = measure_drift(record.background_cells, background_cells(set.background));
  if (drift.red_blue_swapped) throw Error(quoted(set.folder) + ": " + drift.words);
  return drift.words;  // the presses show whether it matters
}

int run_check(CheckArguments arguments) {
  if (std::filesystem::is_directory(arguments.model) &&
      std::filesystem::is_regular_file(arguments.presses.folder))
    throw Error("'" + arguments.model.string() + "' is a folder, and '" + arguments.presses.folder.string() +
                "' a file: the model comes first, then the presses");
  const InterruptWatch interrupt;
  const std::unique_ptr<ProgressSink> progress = make_progress(arguments.presses.quiet);
  const ModelFile file = read_model_file(arguments.model);
  const PressSet set = read_presses(arguments.presses, file);
  std::vector<std::string> findings = {"optics: " + optics_text(*set.optics)};
  if (file.record) findings.push_back(drift_since(*file.record, set));
  const BallZones zones = find_zones_for_people(set, arguments.presses, true, *progress, interrupt);
  progress->begin("checking", static_cast<std::int64_t>(zones.zones.size()));
  const auto show = [&](std::size_t done) {
    stop_if_asked(interrupt);
    progress->update(static_cast<std::int64_t>(done));
  };
  const ModelCheck check = check_model(file.model, set, zones.zones, arguments.presses.pitch_mm, show);
  progress->end();
  if (arguments.json)
    std::cout << to_json(check, findings, set, zones).dump(1) << "\n";
  else
    print_for_people(check, findings);
  return check.verdict == Verdict::recalibrate ? kExitNotGood : kExitDone;
}

}  // namespace

void add_calibrate_check_command(CLI::App& calibrate, int& exit_code) {
  CLI::App* command = calibrate.add_subcommand("check", "Judge a model on presses of balls");
  const auto arguments = std::make_shared<CheckArguments>();
  command->add_option("MODEL", arguments->model, "Model to judge (ours or nnmodel.pth)")->required();
  arguments->presses.add_to(*command);
  command->add_flag("--json", arguments->json, "Print one JSON object for another program");
  command->footer(
      "Presses without a label are labeled automatically. Prints good, usable or recalibrate, and why.\n"
      "Use presses that the model was not trained on. Exit code 1: recalibrate.\n"
      "Example: gelslam calibrate check model.json PRESSES");
  command->callback([arguments, &exit_code] { exit_code = run_check(*arguments); });
}

}  // namespace gelslam
