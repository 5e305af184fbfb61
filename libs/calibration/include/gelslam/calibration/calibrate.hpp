#pragma once

#include <array>
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
  int steps = 36'000;  ///< Optimization steps of 1024 samples each.
};

/// Trains a gradient model on the zones of a set. The difference between the model's readings of press and
/// background is fitted to the slopes of the ball, as this difference is what is used later. Deterministic
/// for a seed and a type of processor. Throws Error when there is less than one batch of samples. To cancel,
/// `progress` may throw an exception.
GradientModel train_model(const PressSet& set, const std::vector<BallZone>& zones,
                          const ModelTraining& training, ProgressSink& progress);

/// Two models for cross-validation. Each was trained on every second zone of each ball, with half of the
/// steps. Model k % 2 was not trained on zone k.
struct HalfModels {
  std::array<GradientModel, 2> models;
  std::vector<BallZone> zones;
};
/// Trains both models. Throws as train_model().
HalfModels train_halves(const PressSet& set, const std::vector<BallZone>& zones,
                        const ModelTraining& training, ProgressSink& progress);

/// Returns the standard deviation of the slopes (rad) in each cell of the image, for a model that was trained
/// on the whole set (GradientModel::sigma_rad). It is estimated from the errors of the two half models on
/// presses that they were not trained on. Each press counts once in a cell, and default_uncertainty() is a
/// prior with a small weight, which remains in cells without presses.
std::vector<float> held_out_sigma_rad(const HalfModels& halves, const PressSet& set, double pixel_pitch_mm);

/// A trained model, with the errors of its half models on presses that they were not trained on.
struct Calibration {
  ModelFile file;
  ModelCheck check;
};

/// Makes a model from a set of presses: finds the balls, refuses sets that do not suffice (missing labels,
/// gaps in the coverage), trains and checks. If `automatic` is true, presses without a label are labeled
/// automatically. `say_left_out` is called with a sentence for every press that cannot be used. Throws Error.
/// To cancel, `progress` may throw an exception.
Calibration calibrate(const PressSet& set, const ModelTraining& training, bool automatic,
                      ProgressSink& progress, const std::function<void(const std::string&)>& say_left_out);

}  // namespace gelslam
