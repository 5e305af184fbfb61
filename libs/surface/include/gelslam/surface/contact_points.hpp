#pragma once

#include <Eigen/Core>
#include <vector>

#include "gelslam/surface/surface.hpp"

namespace gelslam {

/// Distance of the points along rows and columns: dense enough to tell which patches overlap.
constexpr int kContactPointStepPx = 8;

/// Points of the contact on a coarse grid, in the sensor frame.
std::vector<Eigen::Vector3d> coarse_contact_points_mm(const Surface& surface);

/// The middle of the contact, x and y in the sensor frame; the origin where there is none.
Eigen::Vector2d contact_center_mm(const Surface& surface);

/// Whether a point of the sensor frame lies in the contact and close to its height (so not on the object's
/// other side).
bool shows(const Surface& surface, const Eigen::Vector3d& point_mm);

}  // namespace gelslam
