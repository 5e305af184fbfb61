#include "simulated_frames.hpp"

#include "gelslam/core/progress.hpp"
#include "gelslam/simulation/calibration_set.hpp"
#include "gelslam/simulation/simulator.hpp"
#include "gelslam/surface/surface_estimator.hpp"

namespace gelslam::lab {
namespace {

constexpr int kFrames = 96;

}  // namespace

GradientModel quickly_trained_model() {
  CalibrationSpec spec;
  spec.presses = 60;
  spec.training.epochs = 20;
  NoProgress progress;
  return train_on_presses(spec, progress);
}

namespace {

SimulatedFrames make() {
  ScanSpec spec;
  spec.object.name = "peanut";
  spec.motion.frame_rate_hz = 8 * 25;  // eight frames are 0.1 mm
  spec.motion.frames = 8 * 120;
  const Simulator simulator(spec);
  SimulatedFrames frames;
  frames.model = quickly_trained_model();
  frames.background = simulator.frame(0).bgr;
  SurfaceEstimator estimator(frames.model, frames.background, SurfaceOptions{});
  for (int i = 0; i < kFrames; ++i) {
    frames.pictures.push_back(simulator.frame(simulator.frame_count() - kFrames + i).bgr);
    frames.surfaces.push_back(estimator.estimate(frames.pictures.back()));
  }
  return frames;
}

}  // namespace

const SimulatedFrames& simulated_frames() {
  static const SimulatedFrames frames = make();
  return frames;
}

}  // namespace gelslam::lab
