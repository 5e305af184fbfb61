#pragma once

#include <opencv2/core/mat.hpp>

#include "gelslam/simulation/gel.hpp"
#include "gelslam/simulation/sensor_geometry.hpp"

namespace gelslam::simulation::detail {

/// A ball in the gel, and the circle inside which the gel lies on it.
struct PressedBall {
  GelShape gel;
  cv::Point2d center_px;
  double radius_px = 0;  ///< 0: no contact
};

/// `x_mm`, `y_mm`: place of the ball's middle; `depth_mm`: how far its lowest point lies below the untouched
/// gel.
PressedBall press_ball(const SensorGeometry& geometry, const GelOptions& gel, double ball_radius_mm,
                       double x_mm, double y_mm, double depth_mm);

}  // namespace gelslam::simulation::detail
