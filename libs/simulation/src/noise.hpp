#pragma once

#include <Eigen/Core>
#include <cstdint>

namespace gelslam::simulation::detail {

/// Gradient noise (Perlin 1985, quintic fade 2002) on the integer lattice, about -1 .. 1, smooth to the
/// second derivative. Different seeds give unrelated fields.
float gradient_noise(const Eigen::Vector3f& point, std::uint32_t seed);

}  // namespace gelslam::simulation::detail
