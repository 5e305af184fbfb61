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
#include "gelslam/calibration/pixel_pitch.hpp"
#include "gelslam/core/error.hpp"
#include "gelslam/core/text.hpp"
#include "gelslam/sensor/image_input.hpp"
#include "gelslam/slam/config.hpp"
#include "gelslam/surface/model_file.hpp"
#include "terminal_progress.hpp"

namespace gelslam {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::ordered_json;

struct CheckArguments {
  PressOptions presses;
  fs::path model, report;
  std::vector<fs::path> rulers;
  double period_mm = 0.0;
  bool json = false, overwrite = false;
};

Json finite(double value) { return std::isfinite(value) ? Json(value) : Json(nullptr); }

Json scales_to_json(const ModelCheck& check) {
  Json ninths = Json::array();
  for (std::size_t k = 0; k < 9; ++k) {
    const SlopeSums ninth = check.slopes.ninth(k);
    ninths.push_back(
        {{"gain_x", finite(ninth.scale_x())}, {"gain_y", finite(ninth.scale_y())}, {"pixels", ninth.pixels}});
  }
  return {{"x", finite(check.slopes.all.scale_x())},
          {"y", finite(check.slopes.all.scale_y())},
          {"ninths", std::move(ninths)}};
}

Json to_json(const ModelCheck& check, const PressSet& set, const BallZones& zones) {
  Json json = {{"verdict", verdict_name(check.verdict)},
               {"reasons", check.reasons},
               {"findings", check.findings},
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

void print_for_people(const ModelCheck& check) {
  fmt::print("{}\n", verdict_name(check.verdict));
  for (const std::string& reason : check.reasons) fmt::print("  {}\n", reason);
  fmt::print("slope error {:.2f} degrees on {} presses; gradient scale (read over true) x {:.3f}, y {:.3f}\n",
             check.slopes.all.mean_abs_error_deg(), check.presses.size(), check.slopes.all.scale_x(),
             check.slopes.all.scale_y());
  for (const DiameterCheck& ball : check.diameters)
    fmt::print("ball of {:.2f} mm: median radius {:.3f} mm ({:+.1f} %) over {} presses\n", ball.diameter_mm,
               ball.median_radius_mm, 100.0 * ball.radius_error(), ball.presses);
  for (const std::string& finding : check.findings) fmt::print("{}\n", finding);
}

/// Throws Error when red and blue have changed places since the model was made.
Finding drift_since(const CalibrationRecord& record, const PressSet& set) {
  const BackgroundDrift drift = measure_drift(record.background_cells, background_cells(set.background));
  if (drift.red_blue_swapped) throw Error(quoted(set.folder) + ": " + drift.words);
  return {Verdict::good, drift.words};  // the presses show whether it matters
}

constexpr double kCoarse = 0.05;  // a measurement that may be further off says nothing of use

Finding pixel_finding(const PixelAspect& aspect) {
  const double tolerance = aspect.tolerance(), off = std::abs(aspect.y_over_x - 1.0);
  const std::string measured =
      fmt::format("height over width {:.3f} +- {:.3f}", aspect.y_over_x, aspect.uncertainty);
  if (off > tolerance)
    return {Verdict::recalibrate, "pixels are not square (" + measured +
                                      "): stretch the pictures to square pixels, then calibrate again"};
  if (tolerance > kCoarse)
    return {Verdict::good, "the pictures do not show whether pixels are square (" + measured + ")"};
  return {Verdict::good, fmt::format("pixels are square within {:.0f} % ({})", 100.0 * tolerance, measured)};
}

PatternWave wave_in(const fs::path& ruler, const cv::Mat3b& background, const SensorProfile& profile,
                    double period_px, double period_mm) {
  const cv::Mat3b picture = fit_to_profile(read_image(ruler), profile, quoted(ruler));
  if (picture.size() != background.size())
    throw Error(quoted(ruler) + " is " + size_text(picture.cols, picture.rows) + " but the background is " +
                size_text(background.cols, background.rows));
  if (const auto wave = find_pattern(picture, background, period_px)) return *wave;
  throw Error(quoted(ruler) +
              fmt::format(": no marks {:.2f} mm apart stand out (looked for {:.0f} to {:.0f} pixels); press "
                          "them in evenly, at least four of them, and give --pitch if it is far off",
                          period_mm, 0.8 * period_px, 1.25 * period_px));
}

Finding pitch_finding(const PixelPitch& pitch, double assumed_mm) {
  std::string words =
      fmt::format("the ruler shows {:.5f} +- {:.5f} mm per pixel", pitch.x_mm, pitch.x_uncertainty_mm);
  if (pitch.both_axes)
    words += fmt::format(" in x, {:.5f} +- {:.5f} in y", pitch.y_mm, pitch.y_uncertainty_mm);
  const double mean_mm = std::sqrt(pitch.x_mm * pitch.y_mm);
  if (std::abs(mean_mm / assumed_mm - 1.0) <= kMaxPitchError)
    return {Verdict::good,
            fmt::format("{}; {:.5f} is right within {:.0f} %", words, assumed_mm, 100.0 * kMaxPitchError)};
  return {Verdict::recalibrate,
          fmt::format("{}, not {:.5f}: write ppmm: {:.5f}, and calibrate again", words, assumed_mm, mean_mm)};
}

void add_ruler_findings(const CheckArguments& arguments, std::vector<Finding>& findings) {
  const PressOptions& presses = arguments.presses;
  const SensorProfile profile = presses.config.empty() ? SensorProfile{} : read_config(presses.config).sensor;
  const cv::Mat3b background = read_image(presses.folder / "background.png");
  const double period_px = arguments.period_mm / presses.pitch_mm;
  std::vector<PatternWave> waves;
  for (const fs::path& ruler : arguments.rulers)
    waves.push_back(wave_in(ruler, background, profile, period_px, arguments.period_mm));
  const PixelPitch pitch = pitch_from_pattern(waves, arguments.period_mm);
  findings.push_back(pitch_finding(pitch, presses.pitch_mm));
  if (pitch.both_axes) findings.push_back(pixel_finding(pitch.aspect()));
}

int run_check(CheckArguments arguments) {
  check_output_file(arguments.report, arguments.overwrite);
  if (std::filesystem::is_directory(arguments.model) &&
      std::filesystem::is_regular_file(arguments.presses.folder))
    throw Error("'" + arguments.model.string() + "' is a folder, and '" + arguments.presses.folder.string() +
                "' a file: the model comes first, then the presses");
  const InterruptWatch interrupt;
  const std::unique_ptr<ProgressSink> progress = make_progress(arguments.presses.quiet);
  const ModelFile file = read_model_file(arguments.model);
  const PressSet set = read_presses(arguments.presses, file);
  std::vector<Finding> findings;
  findings.push_back({Verdict::good, "optics: " + optics_text(*set.optics)});
  if (file.record) findings.push_back(drift_since(*file.record, set));
  if (!arguments.rulers.empty()) add_ruler_findings(arguments, findings);
  const BallZones zones = find_zones_for_people(set, arguments.presses, true, *progress, interrupt);
  if (arguments.rulers.empty())
    if (const auto aspect = aspect_from_balls(set, zones.zones, arguments.presses.pitch_mm))
      findings.push_back(pixel_finding(*aspect));
  progress->begin("checking", static_cast<std::int64_t>(zones.zones.size()));
  const auto show = [&](std::size_t done) {
    stop_if_asked(interrupt);
    progress->update(static_cast<std::int64_t>(done));
  };
  const ModelCheck check =
      check_model(file.model, set, zones.zones, arguments.presses.pitch_mm, show, findings);
  progress->end();
  if (!arguments.report.empty()) write_check_report(arguments.report, check, set, arguments.model.string());
  if (arguments.json)
    std::cout << to_json(check, set, zones).dump(1) << "\n";
  else
    print_for_people(check);
  return check.verdict == Verdict::recalibrate ? kExitNotGood : kExitDone;
}

}  // namespace

void add_calibrate_check_command(CLI::App& calibrate, int& exit_code) {
  CLI::App* command = calibrate.add_subcommand("check", "Judge a model on presses of balls");
  const auto arguments = std::make_shared<CheckArguments>();
  command->add_option("MODEL", arguments->model, "Model to judge (ours or nnmodel.pth)")->required();
  arguments->presses.add_to(*command);
  command->add_option("-o,--output", arguments->report, "Also write a page for the browser (.html)")
      ->check(refuse_unless_html);
  command->add_flag("--json", arguments->json, "Print one JSON object for another program");
  add_overwrite_flag(*command, arguments->overwrite);
  CLI::Option* rulers = command->add_option(
      "--ruler", arguments->rulers, "Pictures of marks at even distances, pressed in along x and along y");
  CLI::Option* period = command->add_option("--period", arguments->period_mm, "Distance of the marks, mm")
                            ->check(number_between(0.05, 50.0));
  rulers->needs(period);
  period->needs(rulers);
  command->footer(
      "Presses without a label are labeled automatically. Prints good, usable or recalibrate, and why.\n"
      "Use presses that the model was not trained on. Exit code 1: recalibrate.\n"
      "Balls do not show a wrong pitch: lay a steel ruler or a bolt on the gel (thread of M5: 0.8 mm, M6: "
      "1.0).\n"
      "Example: gelslam calibrate check model.json PRESSES -o check.html");
  command->callback([arguments, &exit_code] { exit_code = run_check(*arguments); });
}

}  // namespace gelslam
