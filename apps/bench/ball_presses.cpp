// Study: how well do reconstructed heights give back balls of known diameter?
// For each press of a calibration folder, a sphere is fitted to the height inside the contact circle; what is
// printed per diameter is the median fitted radius and its error. A gain error of the slopes shows here
// directly.

#include <CLI/CLI.hpp>
#include <Eigen/Dense>
#include <algorithm>
#include <charconv>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <iostream>
#include <map>
#include <nlohmann/json.hpp>
#include <optional>
#include <sstream>
#include <string>
#include <vector>

#include "ball_fit.hpp"
#include "gelslam/core/error.hpp"
#include "gelslam/sensor/image_input.hpp"
#include "gelslam/surface/surface_estimator.hpp"
#include "npz_label.hpp"

namespace gelslam::bench {
namespace {

namespace fs = std::filesystem;

struct Press {
  std::string name;
  double diameter_mm = 0.0;
};

struct PressResult {
  Press press;
  Circle circle;
  bool labelled = false;
  double radius_mm = 0.0;
  double error() const { return radius_mm / (0.5 * press.diameter_mm) - 1.0; }
};

struct Arguments {
  fs::path folder;
  fs::path model;  // empty: <folder>/model/nnmodel.pth
  double pitch_mm = 0.0634;
  bool everywhere = false;
  bool json = false;
};

std::vector<Press> read_catalog(const fs::path& path) {
  std::ifstream stream(path);
  if (!stream)
    throw Error("'" + path.string() + "' cannot be read (expected a calibration folder's catalog.csv)");
  std::vector<Press> presses;
  std::string line;
  std::getline(stream, line);  // header
  while (std::getline(stream, line)) {
    if (!line.empty() && line.back() == '\r') line.pop_back();
    if (line.empty()) continue;
    const std::size_t comma = line.rfind(',');
    Press press;
    const char* end = line.data() + line.size();
    if (comma == std::string::npos ||
        std::from_chars(line.data() + comma + 1, end, press.diameter_mm).ptr != end ||
        !(press.diameter_mm > 0.1 && press.diameter_mm < 1000.0)) {
      throw Error("'" + path.string() + "': cannot read line '" + line +
                  "' (expected folder,diameter in mm)");
    }
    press.name = line.substr(0, comma);
    presses.push_back(press);
  }
  if (presses.empty()) throw Error("'" + path.string() + "' names no presses");
  return presses;
}

std::vector<PressResult> measure(const Arguments& arguments, std::vector<std::string>& failed) {
  const fs::path model_path =
      arguments.model.empty() ? arguments.folder / "model" / "nnmodel.pth" : arguments.model;
  SurfaceOptions options;
  options.pixel_pitch_mm = arguments.pitch_mm;
  options.gradient_everywhere = arguments.everywhere;
  const GradientModel model = read_pth_model(model_path);
  const cv::Mat3b background = read_image(arguments.folder / "background.png");
  std::vector<PressResult> results;
  for (const Press& press : read_catalog(arguments.folder / "catalog.csv")) {
    const fs::path folder = arguments.folder / press.name;
    // A new estimator for each press: they are single pictures, with no light to follow from one to the next.
    const SurfacePtr surface =
        SurfaceEstimator(model, background, options).estimate(read_image(folder / "gelsight.png"));
    PressResult result{press, {}, fs::exists(folder / "label.npz"), 0.0};
    const std::optional<Circle> circle =
        result.labelled ? read_npz_label(folder / "label.npz") : find_contact_circle(*surface);
    const std::optional<double> radius_mm =
        circle ? fit_ball_radius_mm(*surface, *circle, 0.5 * press.diameter_mm) : std::nullopt;
    if (!radius_mm) {
      failed.push_back(press.name);
      continue;
    }
    result.circle = *circle;
    result.radius_mm = *radius_mm;
    results.push_back(result);
  }
  return results;
}

double quantile(std::vector<double> values, double fraction) {
  std::sort(values.begin(), values.end());
  return values[static_cast<std::size_t>(std::lround(fraction * static_cast<double>(values.size() - 1)))];
}

nlohmann::json summarise(const std::vector<PressResult>& results, const std::vector<std::string>& failed) {
  std::map<double, std::vector<const PressResult*>> by_diameter;
  for (const PressResult& result : results) by_diameter[result.press.diameter_mm].push_back(&result);
  nlohmann::json summary;
  summary["failed"] = failed;
  summary["diameters"] = nlohmann::json::array();
  for (const auto& [diameter_mm, group] : by_diameter) {
    std::vector<double> radii, errors;
    for (const PressResult* result : group) {
      radii.push_back(result->radius_mm);
      errors.push_back(std::abs(result->error()));
    }
    const double median_mm = quantile(radii, 0.5);
    summary["diameters"].push_back(
        {{"diameter_mm", diameter_mm},
         {"presses", group.size()},
         {"median_radius_mm", median_mm},
         {"median_radius_error_percent", 100.0 * (median_mm / (0.5 * diameter_mm) - 1.0)},
         {"median_abs_error_percent", 100.0 * quantile(errors, 0.5)},
         {"p90_abs_error_percent", 100.0 * quantile(errors, 0.9)}});
  }
  for (const PressResult& result : results) {
    summary["presses"].push_back({{"name", result.press.name},
                                  {"diameter_mm", result.press.diameter_mm},
                                  {"labelled", result.labelled},
                                  {"center_px", {result.circle.u_px, result.circle.v_px}},
                                  {"circle_radius_px", result.circle.radius_px},
                                  {"radius_mm", result.radius_mm}});
  }
  return summary;
}

void print_table(const nlohmann::json& summary) {
  std::printf("%-12s %8s %18s %10s %18s %12s\n", "diameter mm", "presses", "median radius mm", "error %",
              "median |error| %", "p90 |error| %");
  for (const auto& row : summary["diameters"]) {
    std::printf("%-12.2f %8d %18.3f %10.1f %18.1f %12.1f\n", row["diameter_mm"].get<double>(),
                row["presses"].get<int>(), row["median_radius_mm"].get<double>(),
                row["median_radius_error_percent"].get<double>(),
                row["median_abs_error_percent"].get<double>(), row["p90_abs_error_percent"].get<double>());
  }
  for (const auto& name : summary["failed"])
    std::printf("no ball found in %s\n", name.get<std::string>().c_str());
}

}  // namespace
}  // namespace gelslam::bench

int main(int argc, char** argv) {
  gelslam::bench::Arguments arguments;
  CLI::App app{"Fit balls of known diameter to the heights of a calibration folder's presses"};
  app.add_option("FOLDER", arguments.folder, "holds catalog.csv, background.png, model/nnmodel.pth")
      ->required();
  app.add_option("--model", arguments.model, "another nnmodel.pth");
  app.add_option("--pitch", arguments.pitch_mm, "mm per pixel")
      ->check(CLI::PositiveNumber)
      ->capture_default_str();
  app.add_flag("--everywhere", arguments.everywhere, "run the network on unchanged pixels too");
  app.add_flag("--json", arguments.json, "one JSON object on stdout, with every press");
  CLI11_PARSE(app, argc, argv);
  try {
    std::vector<std::string> failed;
    const nlohmann::json summary =
        gelslam::bench::summarise(gelslam::bench::measure(arguments, failed), failed);
    if (arguments.json) {
      std::cout << summary.dump(2) << "\n";
    } else {
      gelslam::bench::print_table(summary);
    }
  } catch (const gelslam::Error& error) {
    std::cerr << "ball_presses: error: " << error.what() << "\n";
    return 2;
  }
  return 0;
}
