// Study: which recipe makes the best gradient model on presses it has not seen?
// The presses of a calibration folder are split at random, five times, into four fifths to train on and one
// fifth to test; what is printed per recipe are the slope error, the gradient scale (by axis, by
// steepness, by ninth of the gel; in brackets the standard error in hundredths, from the scatter of the
// presses) and the radius of the reconstructed balls, all on the tested fifths. First come the automatic
// circles against the labels of the folder, if it has any.

#include <fmt/core.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <map>
#include <numeric>
#include <random>
#include <string>
#include <utility>
#include <vector>

#include "gelslam/calibration/circle_finder.hpp"
#include "gelslam/calibration/model_check.hpp"
#include "gelslam/calibration/model_trainer.hpp"
#include "gelslam/core/median.hpp"
#include "gelslam/surface/model_file.hpp"
#include "study.hpp"

namespace gelslam::lab {
namespace {

namespace fs = std::filesystem;
using Clock = std::chrono::steady_clock;

struct CalibrationArguments {
  fs::path folder, model;
  std::string only;
  double pitch_mm = 0.0634;
  int splits = 5;
};

struct Recipe {
  std::string name;
  TrainingRecipe recipe;
  bool drawn_circles = false;  ///< trains on the drawn circles less 4 px, as the public systems do
};

std::vector<Recipe> recipes() {
  TrainingRecipe no_scale, no_moves, no_differences;
  no_scale.correct_scale = false;
  no_moves.move_share = 0.0;
  no_differences.differences = false;
  no_differences.flat_share = 0.2;
  return {{"published", published_recipe(), true}, {"published, zones", published_recipe(), false},
          {"ours, absolute", no_differences},      {"ours, scale not corrected", no_scale},
          {"ours, not moved", no_moves},           {"ours", {}}};
}

double seconds_since(Clock::time_point start) {
  return std::chrono::duration<double>(Clock::now() - start).count();
}

void compare_labels(const PressSet& set, double pitch_mm) {
  std::vector<double> centers, radii, signed_radii;
  std::size_t unclear = 0;
  const auto start = Clock::now();
  for (const CalibrationPress& press : set.presses) {
    const FoundCircle found = find_circle(press.bgr, set.background, 0.5 * press.diameter_mm / pitch_mm);
    if (!found.problem.empty()) ++unclear;
    if (!press.label || !found.problem.empty()) continue;
    centers.push_back(
        std::hypot(found.circle.u_px - press.label->u_px, found.circle.v_px - press.label->v_px));
    signed_radii.push_back(found.circle.radius_px - press.label->radius_px);
    radii.push_back(std::abs(signed_radii.back()));
  }
  fmt::print("circles: {} presses, {} not clear, {:.0f} ms each\n", set.presses.size(), unclear,
             1000.0 * seconds_since(start) / static_cast<double>(set.presses.size()));
  if (!centers.empty())
    fmt::print(
        "against {} labels: center median {:.2f}, 90 % {:.2f} px; radius median |{:.2f}| ({:+.2f}), 90 % "
        "{:.2f} "
        "px\n",
        centers.size(), quantile(centers, 0.5), quantile(centers, 0.9), quantile(radii, 0.5),
        quantile(signed_radii, 0.5), quantile(radii, 0.9));
}

constexpr std::array<double, 6> kSlopeLimits = {0.05, 0.1, 0.2, 0.3, 0.4, 0.6};

struct PressSlopes {
  std::array<SlopeSums, 9> ninths;                      // of the gel, row by row
  std::array<SlopeSums, kSlopeLimits.size()> by_slope;  // steepness up to each limit
};

struct Results {
  SlopeSums slopes;
  std::vector<PressSlopes> press_slopes;
  std::map<double, std::vector<double>> radius_errors;
  double seconds = 0.0;
};

void check(const GradientModel& model, const PressSet& set, const std::vector<BallZone>& zones,
           double pitch_mm, Results& results) {
  for (const BallZone& zone : zones) {  // one by one, to see how much they scatter
    const ModelCheck found = check_model(model, set, {zone}, pitch_mm);
    results.slopes.add(found.slopes.all);
    PressSlopes& slopes = results.press_slopes.emplace_back();
    for (std::size_t k = 0; k < 9; ++k) slopes.ninths[k] = found.slopes.ninth(k);
    for (const ZoneReading& pixel : read_zone(model, set, zone, pitch_mm)) {
      const auto limit = std::ranges::lower_bound(kSlopeLimits, std::hypot(pixel.truth[0], pixel.truth[1]));
      if (limit != kSlopeLimits.end())
        slopes.by_slope[static_cast<std::size_t>(limit - kSlopeLimits.begin())].add(pixel);
    }
    const double diameter_mm = set.presses[zone.press].diameter_mm;
    if (const auto& radius_mm = found.presses.front().radius_mm)
      results.radius_errors[diameter_mm].push_back(*radius_mm / (0.5 * diameter_mm) - 1.0);
  }
}

/// A gradient scale and its standard error from the scatter of the presses; `sums` picks read * true and true
/// * true.
template <class Sums>
void print_scale(const Results& results, const Sums& sums) {
  double read = 0.0, truth = 0.0, squared = 0.0;
  for (const PressSlopes& press : results.press_slopes) {
    const auto [r, t] = sums(press);
    read += r;
    truth += t;
  }
  const double scale = read / truth;
  for (const PressSlopes& press : results.press_slopes) {
    const auto [r, t] = sums(press);
    squared += (r - scale * t) * (r - scale * t);
  }
  fmt::print(" {:.2f}({:.0f})", scale, 100.0 * std::sqrt(squared) / truth);
}

std::pair<double, double> along(const SlopeSums& sums, std::size_t axis) {
  return {sums.read_true[axis], sums.true_true[axis]};
}

void print(const std::string& name, const Results& results) {
  fmt::print("{:<24} error {:.2f} deg  gradient scale x {:.3f} y {:.3f}  by slope", name,
             results.slopes.mean_abs_error_deg(), results.slopes.scale_x(), results.slopes.scale_y());
  for (std::size_t step = 0; step < kSlopeLimits.size(); ++step)
    print_scale(results, [step](const PressSlopes& press) {
      const auto x = along(press.by_slope[step], 0), y = along(press.by_slope[step], 1);
      return std::pair(x.first + y.first, x.second + y.second);
    });
  for (std::size_t axis = 0; axis < 2; ++axis) {
    fmt::print("  by ninth {}", axis == 0 ? "x" : "y");
    for (std::size_t ninth = 0; ninth < 9; ++ninth)
      print_scale(results, [=](const PressSlopes& press) { return along(press.ninths[ninth], axis); });
  }
  for (const auto& [diameter_mm, errors] : results.radius_errors)
    fmt::print("  ball {:.2f} mm {:+.1f} %", diameter_mm, 100.0 * quantile(errors, 0.5));
  if (results.seconds > 0.0) fmt::print("  {:.0f} s", results.seconds);
  fmt::print("\n");
  std::fflush(stdout);
}

std::vector<BallZone> drawn_zones(const PressSet& set, const std::vector<BallZone>& zones, double pitch_mm) {
  std::vector<BallZone> drawn;
  for (BallZone zone : zones) {
    const CalibrationPress& press = set.presses[zone.press];
    const ContactCircle circle =
        press.label ? *press.label
                    : find_circle(press.bgr, set.background, 0.5 * press.diameter_mm / pitch_mm).circle;
    zone.radius_px = circle.radius_px - 4.0;
    drawn.push_back(zone);
  }
  return drawn;
}

void run(const CalibrationArguments& arguments) {
  PressSet set = read_press_set(arguments.folder);
  fill_markers(set);
  compare_labels(set, arguments.pitch_mm);
  const BallZones found = find_ball_zones(set, arguments.pitch_mm, true);
  for (const RejectedPress& press : found.rejected)
    fmt::print("left out: {}, {}\n", set.presses[press.press].name, press.reason);
  const std::vector<BallZone> drawn = drawn_zones(set, found.zones, arguments.pitch_mm);
  const fs::path shipped =
      arguments.model.empty() ? arguments.folder / "model" / "nnmodel.pth" : arguments.model;
  std::map<std::string, Results> results;
  NoProgress quiet;
  StudyCases cases(static_cast<std::size_t>(arguments.splits));
  for (int split = 0; split < arguments.splits; ++split) {
    cases.begin("split " + std::to_string(split + 1));
    std::vector<std::size_t> order(found.zones.size());
    std::iota(order.begin(), order.end(), std::size_t{0});
    std::mt19937_64 random(static_cast<std::uint64_t>(100 + split));
    for (std::size_t k = order.size() - 1; k > 0; --k) std::swap(order[k], order[random() % (k + 1)]);
    const std::size_t training = order.size() * 8 / 10;
    std::vector<BallZone> train, train_drawn, test;
    for (std::size_t k = 0; k < order.size(); ++k) {
      (k < training ? train : test).push_back(found.zones[order[k]]);
      if (k < training) train_drawn.push_back(drawn[order[k]]);
    }
    if (fs::exists(shipped)) check(read_model(shipped), set, test, arguments.pitch_mm, results["shipped"]);
    for (const Recipe& recipe : recipes()) {
      if (!arguments.only.empty() && recipe.name != arguments.only) continue;
      const ModelTraining how{arguments.pitch_mm, static_cast<std::uint64_t>(split + 1), recipe.recipe};
      const auto start = Clock::now();
      const GradientModel model =
          train_model(set, recipe.drawn_circles ? train_drawn : train, how, quiet, [] { return false; });
      results[recipe.name].seconds = std::max(results[recipe.name].seconds, seconds_since(start));
      check(model, set, test, arguments.pitch_mm, results[recipe.name]);
    }
  }
  for (const auto& [name, result] : results) print(name, result);
}

}  // namespace

void add_calibration(CLI::App& lab) {
  const auto arguments = std::make_shared<CalibrationArguments>();
  CLI::App* command = add_study(
      lab, "calibration", "Compare training recipes of the gradient model on presses they have not seen",
      arguments, run);
  command
      ->add_option("FOLDER", arguments->folder,
                   "Folder with catalog.csv, background.png, presses and model/nnmodel.pth")
      ->required();
  command->add_option("--model", arguments->model, "Another model to compare with");
  command->add_option("--only", arguments->only, "One recipe, by its name in the table");
  command->add_option("--splits", arguments->splits, "Random splits")
      ->check(CLI::Range(1, 100))
      ->capture_default_str();
  command->add_option("--pitch", arguments->pitch_mm, "Millimeters per pixel")->capture_default_str();
  command->footer("Example: gelslam-lab calibration DATA/calibration");
}

}  // namespace gelslam::lab
