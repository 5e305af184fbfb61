#pragma once

#include <Eigen/Core>

namespace gelslam::evaluation::detail {

/// The point of triangle abc nearest to p; triangles without area are treated as their edges.
Eigen::Vector3d closest_on_triangle(const Eigen::Vector3d& p, const Eigen::Vector3d& a,
                                    const Eigen::Vector3d& b, const Eigen::Vector3d& c);

}  // namespace gelslam::evaluation::detail
