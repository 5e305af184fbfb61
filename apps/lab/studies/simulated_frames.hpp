#pragma once

#include <opencv2/core/mat.hpp>
#include <vector>

#include "gelslam/simulation/optics.hpp"
#include "gelslam/surface/gradient_model.hpp"
#include "gelslam/surface/surface.hpp"

namespace gelslam::lab {

/// The model of the simulated sensor without optics.
GradientModel flat_sensor_model();

/// What its camera sees while nothing touches.
cv::Mat3b bare_gel(const Optics& optics);

/// Some frames from the middle of a simulated scan (a peanut wobbled at 25 Hz), with the model of the sensor.
struct SimulatedFrames {
  GradientModel model;
  cv::Mat3b background;
  std::vector<cv::Mat3b> pictures;
  std::vector<SurfacePtr> surfaces;
};

/// Made once per program, in a few seconds, always the same.
const SimulatedFrames& simulated_frames();

}  // namespace gelslam::lab
