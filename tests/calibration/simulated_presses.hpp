#pragma once

#include <cmath>
#include <filesystem>
#include <fstream>
#include <opencv2/imgcodecs.hpp>
#include <vector>

#include "gelslam/calibration/ball_zones.hpp"
#include "gelslam/calibration/press_set.hpp"
#include "gelslam/simulation/calibration_set.hpp"

namespace gelslam::test {

/// Presses of the simulator, which knows nothing of the calibration library, with their truth.
struct SimulatedPresses {
  PressSet set;
  std::vector<BallPress> truth;
};

inline SimulatedPresses simulated_presses(int first, int count) {
  const PressSimulator simulator({});
  SimulatedPresses presses;
  presses.set.folder = "simulated";
  presses.set.background = simulator.background();
  for (int k = first; k < first + count; ++k) {
    presses.truth.push_back(simulator.press(k));
    const BallPress& truth = presses.truth.back();
    presses.set.presses.push_back({"press/" + std::to_string(k), truth.diameter_mm, truth.bgr, std::nullopt});
  }
  return presses;
}

/// Forty presses, made once for all tests of a program.
inline const SimulatedPresses& forty_presses() {
  static const SimulatedPresses presses = simulated_presses(0, 40);
  return presses;
}

/// Labels as a careful person draws them: the true circle, this much wider.
inline PressSet labelled(const SimulatedPresses& presses, double factor, double wider_px) {
  PressSet set = presses.set;
  for (std::size_t k = 0; k < set.presses.size(); ++k) {
    const BallPress& truth = presses.truth[k];
    set.presses[k].label =
        ContactCircle{truth.center_px.x, truth.center_px.y, factor * truth.radius_px + wider_px};
  }
  return set;
}

/// The forty with labels 4 px too wide, and their zones; without labels, the zones that are found. Made once,
/// as above.
inline const PressSet& forty_labelled() {
  static const PressSet set = labelled(forty_presses(), 1.0, 4.0);
  return set;
}
inline const BallZones& zones_of_labelled() {
  static const BallZones zones = find_ball_zones(forty_labelled(), 0.0634, false);
  return zones;
}
inline const BallZones& zones_of_forty() {
  static const BallZones zones = find_ball_zones(forty_presses().set, 0.0634, true);
  return zones;
}

/// The set as a calibration folder, labels included. The simulator's camera is orthographic, its gel flat.
inline void write_folder(const std::filesystem::path& folder, const PressSet& set) {
  std::filesystem::create_directories(folder);
  cv::imwrite((folder / "background.png").string(), set.background);
  write_optics(folder / kOpticsFileName, {});
  std::ofstream catalog(folder / "catalog.csv");
  catalog << "experiment_reldir,diameter(mm)\n";
  for (const CalibrationPress& press : set.presses) {
    std::filesystem::create_directories(folder / press.name);
    cv::imwrite((folder / press.name / "gelsight.png").string(), press.bgr);
    if (press.label) write_label(folder / press.name / "label.npz", *press.label);
    catalog << press.name << "," << press.diameter_mm << "\n";
  }
}

}  // namespace gelslam::test
