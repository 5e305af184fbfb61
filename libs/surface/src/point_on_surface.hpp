#pragma once

#include <Eigen/Core>
#include <cmath>

namespace gelslam::surface::detail {

/// Whether a point is close to the height there, so that it does not lie on the object's other side.
inline bool is_close(const Eigen::Vector3d& point_mm, float height_mm) {
  constexpr double kToleranceMm = 0.5;
  return std::abs(point_mm.z() - static_cast<double>(height_mm)) < kToleranceMm;
}

}  // namespace gelslam::surface::detail
