#pragma once

#include <optional>

#include "gelslam/surface/surface.hpp"

namespace gelslam::bench {

struct Circle {
  double u_px = 0.0, v_px = 0.0, radius_px = 0.0;
};

/// Where a ball touches: the centre is the deepest place (centroid of the lowest tenth), the radius where the
/// slope along rays is steepest, since inside the contact it grows outwards and in the gel's skirt it falls.
/// Nothing when there is no contact.
std::optional<Circle> find_contact_circle(const Surface& surface);

/// Radius of the sphere that fits the height inside the circle, shrunk by 4 pixels: robust least squares of
/// height (Huber, Gauss-Newton) over centre and radius, from `start_radius_mm`. Nothing when it has fewer
/// than 100 pixels or does not converge.
std::optional<double> fit_ball_radius_mm(const Surface& surface, const Circle& circle,
                                         double start_radius_mm);

}  // namespace gelslam::bench
