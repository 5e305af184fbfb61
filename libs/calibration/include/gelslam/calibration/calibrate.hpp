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
  int steps = 36'000;  ///< of 1024 samples each
};

/// Trains a gradient model on the zones of a set: the difference of its readings of press and background, as
/// they are used later, is fitted to the ball's slopes. Deterministic for a seed, one kind of processor.
/// Throws Error when there are fewer than one batch of samples. `progress` may stop it by an exception.
GradientModel train_model(const PressSet& set, const std::vector<BallZone>& zones,
                          const ModelTraining& training, ProgressSink& progress);

/// Two models, each trained on every second zone of each ball with half of the steps. Model k % 2 was not
/// trained on zone k.
struct HalfModels {
  std::array<GradientModel, 2> models;
  std::vector<BallZone> zones;
};
/// Throws as train_model.
HalfModels train_halves(const PressSet& set, const std::vector<BallZone>& zones,
                        const ModelTraining& training, ProgressSink& progress);

/// Returns the standard deviation of the slopes that a model of the whole set reads
/// (GradientModel::sigma_rad), from the errors of its halves on presses that they were not trained on. A cell
/// counts every press once, and default_uncertainty() a little: where no press was, it remains.
std::vector<float> held_out_sigma_rad(const HalfModels& halves, const PressSet& set, double pixel_pitch_mm);

/// A trained model, and how its halves read presses that they were not trained on.
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
