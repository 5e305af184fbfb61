#pragma once

#include <Eigen/Core>
#include <vector>

#include "gelslam/surface/surface.hpp"

namespace gelslam {

/// One point for so many pixels in both directions: enough to tell which patches overlap without touching
/// every pixel.
constexpr int kContactPointStepPx = 8;

/// Points of the contact on that coarse grid, in the sensor frame.
std::vector<Eigen::Vector3d> coarse_contact_points_mm(const Surface& surface);

/// Whether a point of the sensor frame lies in the contact, close to its height: not on the object's other
/// side.
bool shows(const Surface& surface, const Eigen::Vector3d& point_mm);

}  // namespace gelslam
