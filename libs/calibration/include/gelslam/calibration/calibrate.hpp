#pragma once

#include <functional>
#include <string>

#include "gelslam/calibration/model_check.hpp"
#include "gelslam/calibration/model_trainer.hpp"
#include "gelslam/calibration/press_set.hpp"
#include "gelslam/surface/model_file.hpp"

namespace gelslam {

struct CalibrationOptions {
  ModelTraining training;
  bool automatic = false;  ///< label presses that have no label
};

/// A trained model, and how it reads the presses it was trained on.
struct Calibration {
  ModelFile file;
  ModelCheck check;
};

/// Presses to a model: finds the balls, refuses sets that cannot make a calibration (labels missing, gaps in
/// the coverage), trains, and checks. `say_left_out` is told of every press that cannot be used. Throws
/// Error. `progress` may stop it by an exception.
Calibration calibrate(const PressSet& set, const CalibrationOptions& options, ProgressSink& progress,
                      const std::function<void(const std::string&)>& say_left_out);

/// Writes PyTorch's format if the name ends in .pth, else our own. Throws Error when the disk does not take
/// it.
void write_calibration(const std::filesystem::path& path, const Calibration& calibration);

}  // namespace gelslam
