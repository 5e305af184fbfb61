#pragma once

#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "gelslam/calibration/model_check.hpp"
#include "gelslam/calibration/press_set.hpp"
#include "gelslam/core/progress.hpp"
#include "gelslam/surface/model_file.hpp"

namespace gelslam {

struct ModelTraining {
  double pixel_pitch_mm = 0.0634;
  std::uint64_t seed = 1;
  int steps = 36'000;  ///< of 1024 samples each
};

/// Trains a gradient model on the zones of a set: the difference of its readings of press and background, as
/// they are used later, is fitted to the ball's slopes. Deterministic for a seed, one kind of processor.
/// Throws Error when there are fewer than one batch of samples. `progress` may stop it by an exception.
GradientModel train_model(const PressSet& set, const std::vector<BallZone>& zones,
                          const ModelTraining& training, ProgressSink& progress);

/// The standard deviation of the slopes that such a model reads (GradientModel::sigma_rad), from presses not
/// trained on: two models, each of every second zone and half of the steps, read the other's. A cell counts
/// every press once, and default_uncertainty() a little: where no press was, it remains. Throws as
/// train_model.
std::vector<float> held_out_sigma_rad(const PressSet& set, const std::vector<BallZone>& zones,
                                      const ModelTraining& training, ProgressSink& progress);

/// A trained model, and how it reads the presses it was trained on.
struct Calibration {
  ModelFile file;
  ModelCheck check;
};

/// Presses to a model: finds the balls, refuses sets that cannot make a calibration (labels missing, gaps in
/// the coverage), trains, and checks. `automatic`: labels presses that have no label. `say_left_out` is told
/// of every press that cannot be used. Throws Error. `progress` may stop it by an exception.
Calibration calibrate(const PressSet& set, const ModelTraining& training, bool automatic,
                      ProgressSink& progress, const std::function<void(const std::string&)>& say_left_out);

}  // namespace gelslam
