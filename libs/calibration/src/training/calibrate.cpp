// The steps of a calibration: find the balls, check the coverage of the gel, train a model on all presses,
// train two models on half of the presses each, and judge these on the other half.

#include "gelslam/calibration/calibrate.hpp"

#include "gelslam/calibration/ball_zones.hpp"
#include "gelslam/core/error.hpp"

namespace gelslam {
namespace {

void require_labels(const PressSet& set) {
  std::size_t bare = 0;
  std::string first;
  for (const CalibrationPress& press : set.presses) {
    if (press.label || press.left_out || !press.problem.empty()) continue;
    if (bare++ == 0) first = press.name;
  }
  if (bare > 0)
    throw Error("'" + set.folder.string() + "': " + std::to_string(bare) + " of " +
                std::to_string(set.presses.size()) + " presses have no label (first: " + first +
                "); label them or leave them out: gelslam calibrate collect " + set.folder.string() +
                "; or allow automatic labels: every clear contact is taken and the rest named");
}

CalibrationRecord record_of(const PressSet& set, const ModelCheck& check, const ModelTraining& training) {
  CalibrationRecord record;
  record.width_px = set.background.cols;
  record.height_px = set.background.rows;
  record.pixel_pitch_mm = training.pixel_pitch_mm;
  record.presses = static_cast<int>(check.presses.size());
  for (const DiameterCheck& ball : check.diameters) record.diameters_mm.push_back(ball.diameter_mm);
  record.seed = training.seed;
  record.background_cells = background_cells(set.background);
  return record;
}

}  // namespace

Calibration calibrate(const PressSet& set, const ModelTraining& training, bool automatic,
                      ProgressSink& progress, const std::function<void(const std::string&)>& say_left_out) {
  const auto count = [&](std::size_t done) { progress.update(static_cast<std::int64_t>(done)); };
  if (!automatic) require_labels(set);
  progress.begin("looking at presses", static_cast<std::int64_t>(set.presses.size()));
  const BallZones zones = find_ball_zones(set, training.pixel_pitch_mm, automatic, count);
  progress.end();
  for (const RejectedPress& press : zones.rejected)
    say_left_out(set.presses[press.press].name + ": " + press.reason);
  require_good_coverage(set, zones);

  GradientModel model = train_model(set, zones.zones, training, progress);
  const HalfModels halves = train_halves(set, zones.zones, training, progress);
  model.sigma_rad = held_out_sigma_rad(halves, set, training.pixel_pitch_mm);
  model.optics = set.optics;
  model.bare_gel_bgr = mean_color(set.background);
  progress.begin("checking", static_cast<std::int64_t>(zones.zones.size()));
  ModelCheck check = check_model(halves.models, set, halves.zones, training.pixel_pitch_mm, count);
  check.add_warning(zones.warning);
  progress.end();
  CalibrationRecord record = record_of(set, check, training);
  return {{std::move(model), std::move(record)}, std::move(check)};
}

}  // namespace gelslam
