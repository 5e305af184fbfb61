#pragma once

#include <filesystem>
#include <fstream>
#include <opencv2/core.hpp>
#include <opencv2/imgcodecs.hpp>
#include <vector>

#include "../support/analytic_surface.hpp"
#include "gelslam/calibration/ball_zones.hpp"
#include "gelslam/calibration/press_set.hpp"
#include "gelslam/simulation/data_folder.hpp"
#include "gelslam/simulation/gel.hpp"
#include "gelslam/simulation/optics.hpp"
#include "random.hpp"

namespace gelslam::test {

/// One press of a ball, with the truth.
struct BallPress {
  cv::Mat3b bgr;
  GelShape gel;
  double diameter_mm = 0;
  cv::Point2d center_px;  ///< of the contact circle
  double radius_px = 0;   ///< the same
};

/// Balls of 6.31 and 9.5 mm in turn, anywhere on a flat gel, at various depths. Any can be asked for by
/// number.
inline BallPress press_number(int number) {
  using simulation::detail::hash;
  static const Optics optics({}, {});
  const SensorGeometry geometry;
  simulation::detail::Random random(hash(1 ^ 0xca11b, static_cast<std::uint64_t>(number)));
  BallPress press;
  press.diameter_mm = number % 2 == 0 ? 6.31 : 9.5;
  const double radius = 0.5 * press.diameter_mm;
  const double x = random.uniform(-1, 1) * (geometry.half_width_mm() - 0.3);
  const double y = random.uniform(-1, 1) * (geometry.half_height_mm() - 0.3);
  const PressedBall ball = press_ball(optics.gel_grid(), radius, x, y, random.uniform(0.08, 0.33) * radius);
  press.bgr = optics.render(ball.gel, -1 - number, false);
  press.gel = ball.gel;
  const ImageCircle circle = seen_circle(optics, ball);
  press.center_px = circle.center_px;
  press.radius_px = circle.radius_px;
  return press;
}

/// A log of presses, with the truth.
struct Film {
  std::vector<cv::Mat3b> frames;
  std::vector<SimulatedTouch> touches;
};

inline Film film(const PressLogSpec& spec) {
  Film film;
  film.touches = simulate_press_log(spec, [&](const cv::Mat3b& bgr) { film.frames.push_back(bgr.clone()); });
  return film;
}

/// Mean of ten pictures without contact, as a person would take it.
inline cv::Mat3b bare_gel(const OpticsOptions& options = {}) {
  const Optics optics({}, options);
  const GelShape rest = gel_at_rest(optics.gel_grid());
  cv::Mat3f sum(rest.height_mm.size(), cv::Vec3f(0, 0, 0));
  for (int k = 0; k < 10; ++k)
    cv::add(sum, optics.render(rest, -3'000'000 - k, false), sum, cv::noArray(), CV_32F);
  cv::Mat3b mean;
  sum.convertTo(mean, CV_8U, 0.1);
  return mean;
}

/// Presses of the simulator, which knows nothing of the calibration library, with their truth.
struct SimulatedPresses {
  PressSet set;
  std::vector<BallPress> truth;
};

inline SimulatedPresses simulated_presses(int first, int count) {
  SimulatedPresses presses;
  presses.set.folder = "simulated";
  presses.set.background = bare_gel();
  for (int k = first; k < first + count; ++k) {
    presses.truth.push_back(press_number(k));
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
  static const BallZones zones = find_ball_zones(forty_labelled(), kPitchMm, false);
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
