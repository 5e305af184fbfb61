#pragma once

#include <optional>

#include "gelslam/calibration/ball_zones.hpp"
#include "gelslam/surface/surface.hpp"

namespace gelslam {

/// Radius of the sphere that fits the height inside the zone: robust least squares (Huber, Gauss-Newton) over
/// center and radius, from `start_radius_mm`. Nothing when it has fewer than 100 pixels or does not converge.
std::optional<double> fit_ball_radius_mm(const Surface& surface, const BallZone& zone,
                                         double start_radius_mm);

}  // namespace gelslam
