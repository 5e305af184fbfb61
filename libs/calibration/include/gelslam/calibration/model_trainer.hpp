#pragma once

#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "gelslam/calibration/ball_zones.hpp"
#include "gelslam/calibration/press_set.hpp"
#include "gelslam/core/gradient_model.hpp"
#include "gelslam/core/progress.hpp"

namespace gelslam {

/// How a network is trained. The default is ours; published_recipe() is that of the public systems.
struct TrainingRecipe {
  int steps = 36000;            ///< of 1024 samples each
  double learning_rate = 3e-3;  ///< Adam; falls to 0 along a cosine
  bool absolute_loss = false;   ///< L1 instead of L2
  double flat_share = 0.0;      ///< share of samples that are background pixels with slope 0
  bool differences = true;      ///< fit the difference from the background's reading, which is used later
  bool correct_scale = true;    ///< undo regression to the mean, per place and axis
  double move_share = 0.5;      ///< of the samples, moved over the gel as a smooth model of its colors says
  double move_reach = 0.15;     ///< how far (standard deviation, in widths of the picture)
  double light_jitter = 0.01;   ///< relative, per channel and sample
};
TrainingRecipe published_recipe();

struct ModelTraining {
  double pixel_pitch_mm = 0.0634;
  std::uint64_t seed = 1;
  TrainingRecipe recipe;
};

/// Trains a gradient model on the zones of a set: deterministic for a seed, one kind of processor. `stop` is
/// asked now and then; when it says true, Error "stopped" is thrown. Throws Error when there are fewer than
/// one batch of samples.
GradientModel train_model(const PressSet& set, const std::vector<BallZone>& zones,
                          const ModelTraining& training, ProgressSink& progress,
                          const std::function<bool()>& stop);

/// The standard deviation of the slopes that such a model reads (GradientModel::sigma_rad), from presses not
/// trained on: two models, each of every second zone and half of the steps, read the other's. A cell counts
/// every press once, and default_uncertainty() a little: where no press was, it remains. Throws as
/// train_model.
std::vector<float> held_out_sigma_rad(const PressSet& set, const std::vector<BallZone>& zones,
                                      const ModelTraining& training, ProgressSink& progress,
                                      const std::function<bool()>& stop);

}  // namespace gelslam
