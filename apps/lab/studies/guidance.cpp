// Study: what the arrow of the live window is worth. A virtual hand scans simulated objects: along the arrow,
// in a fixed pattern, and at random. Reported: frames until so much of what a hand can touch is in the mesh,
// and how right the map is in the end.

#include <array>
#include <filesystem>
#include <string>
#include <vector>

#include "gelslam/core/error.hpp"
#include "gelslam/core/parallel.hpp"
#include "gelslam/surface/model_file.hpp"
#include "guided_scan.hpp"
#include "simulated_frames.hpp"
#include "study.hpp"

namespace gelslam::lab {
namespace {

struct GuidanceArguments {
  std::vector<std::string> objects = {"pebble:0.7", "peanut:0.7", "golf:0.4", "coin:1.5"};
  std::vector<std::string> patterns = {"guided", "fixed", "random"};
  std::filesystem::path model, out;
  int frames = 1000, seeds = 3, threads = 0;
  double speed_mm_s = 6;
};

constexpr std::array<double, 3> kShares = {0.80, 0.90, 0.95};

/// "pebble:0.7" is the pebble at 0.7 of its size.
ShapeSpec shape_of(const std::string& text) {
  ShapeSpec spec;
  const std::size_t colon = text.find(':');
  spec.name = text.substr(0, colon);
  if (colon == std::string::npos) return spec;
  const std::string size = text.substr(colon + 1);
  try {
    std::size_t used = 0;
    spec.size = std::stod(size, &used);
    if (used == size.size()) return spec;
  } catch (const std::exception&) {  // said below
  }
  throw Error("'" + text + "' is no object and its size, as in pebble:0.7");
}

HandPattern pattern_of(const std::string& name) {
  return name == "guided" ? HandPattern::guided : name == "fixed" ? HandPattern::fixed : HandPattern::random;
}

Json row_of(const std::string& object, const std::string& pattern, const GuidedScanSpec& spec,
            const GuidedScanResult& result) {
  Json row = {{"object", object}, {"pattern", pattern}, {"seed", spec.seed}};
  for (const double share : kShares) {
    const std::optional<int> frames = frames_to(result, share);
    row["frames_to_" + std::to_string(static_cast<int>(100 * share + 0.5))] = frames ? Json(*frames) : Json();
  }
  row.update({{"covered", result.coverage.empty() ? 0.0 : result.coverage.back()},
              {"mesh_mm", result.mesh_mm},
              {"drift_mm", result.drift_mm},
              {"worst_drift_mm", result.worst_drift_mm},
              {"not_tracked", result.lost},
              {"trials", result.trials},
              {"pieces", result.components},
              {"loops", result.loops}});
  return row;
}

void run(const GuidanceArguments& arguments) {
  const GradientModel model = arguments.model.empty() ? quickly_trained_model() : read_model(arguments.model);
  Json rows = Json::array(), curves = Json::array();
  StudyCases cases(arguments.objects.size());
  for (const std::string& name : arguments.objects) {
    cases.begin(name);
    const GuidanceObject object = make_guidance_object(shape_of(name));
    const std::size_t patterns = arguments.patterns.size();
    std::vector<GuidedScanSpec> specs(patterns * static_cast<std::size_t>(arguments.seeds));
    for (std::size_t i = 0; i < specs.size(); ++i)
      specs[i] = {pattern_of(arguments.patterns[i % patterns]), arguments.frames, arguments.speed_mm_s,
                  1 + i / patterns};
    std::vector<GuidedScanResult> results(specs.size());
    parallel_for(specs.size(), arguments.threads,
                 [&](std::size_t i) { results[i] = scan_with_hand(object, model, specs[i]); });
    for (std::size_t i = 0; i < specs.size(); ++i) {
      const std::string& pattern = arguments.patterns[i % patterns];
      rows.push_back(row_of(object.name, pattern, specs[i], results[i]));
      for (std::size_t k = 0; k < results[i].coverage.size(); ++k)
        curves.push_back({{"object", object.name},
                          {"pattern", pattern},
                          {"seed", specs[i].seed},
                          {"frames", kCoverageFrames * static_cast<int>(k + 1)},
                          {"covered", results[i].coverage[k]}});
    }
    write_study(arguments.out, "guidance", rows);
    write_study(arguments.out, "guidance_curves", curves);
  }
  print_table(rows);
}

}  // namespace

void add_guidance(CLI::App& lab) {
  const auto arguments = std::make_shared<GuidanceArguments>();
  CLI::App* command = add_study(
      lab, "guidance", "Scan with a virtual hand: along the live window's arrow, in a pattern, at random",
      arguments, run);
  add_list(*command, "--objects", arguments->objects,
           "Simulated objects and their size (gelslam simulate --list)")
      ->capture_default_str();
  add_list(*command, "--patterns", arguments->patterns, "What the hand follows")
      ->check(CLI::IsMember({"guided", "fixed", "random"}))
      ->capture_default_str();
  command->add_option("--frames", arguments->frames, "Frames of each scan, 25 a second")
      ->check(CLI::Range(kCoverageFrames, 20'000))
      ->capture_default_str();
  command->add_option("--seeds", arguments->seeds, "Scans of each kind: other starts, another unsteadiness")
      ->check(CLI::Range(1, 100))
      ->capture_default_str();
  command->add_option("--speed", arguments->speed_mm_s, "Of the touch over the object, mm/s")
      ->check(CLI::Range(0.1, 30.0))
      ->capture_default_str();
  command->add_option("--threads", arguments->threads, "Scans at a time (0: one per core)")
      ->check(CLI::Range(0, 64));
  command->add_option("--model", arguments->model,
                      "Gradient model of the simulated sensor (default: train one on a few presses)");
  command->add_option("-o,--output", arguments->out,
                      "Folder for guidance.csv, guidance_curves.csv and the same as .json");
  command->footer("Example: gelslam-lab guidance -o STUDY && scripts/plot_guidance.py STUDY");
}

}  // namespace gelslam::lab
