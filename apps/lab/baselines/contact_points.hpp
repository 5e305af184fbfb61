#pragma once

#include <Eigen/Core>
#include <vector>

#include "gelslam/surface/surface.hpp"

namespace gelslam::baselines::detail {

/// Points of a contact in mm and their unit normals, in the sensor's frame.
struct ContactPoints {
  std::vector<Eigen::Vector3d> position_mm, normal;

  std::size_t size() const { return position_mm.size(); }
};

/// Fewer points than this are no surface to register.
inline constexpr std::size_t kMinPoints = 10;

/// At most `max_points` of the contact's pixels, spread evenly over them in raster order.
ContactPoints contact_points(const Surface& surface, int max_points);

}  // namespace gelslam::baselines::detail
