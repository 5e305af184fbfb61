#pragma once

#include <opencv2/core/mat.hpp>
#include <vector>

#include "gelslam/simulation/optics.hpp"
#include "gelslam/surface/gradient_model.hpp"
#include "gelslam/surface/surface.hpp"

namespace gelslam::lab {

/// Returns the gradient model of the simulated sensor without optics.
GradientModel flat_sensor_model();

/// Returns the image of its camera without contact.
cv::Mat3b bare_gel(const Optics& optics);

/// Frames from the middle of a simulated scan (a peanut that is wobbled, at 25 Hz), with the gradient model
/// of the sensor.
struct SimulatedFrames {
  GradientModel model;
  cv::Mat3b background;
  std::vector<cv::Mat3b> pictures;
  std::vector<SurfacePtr> surfaces;
};

/// Simulated once per program, in a few seconds, always with the same result.
const SimulatedFrames& simulated_frames();

}  // namespace gelslam::lab
