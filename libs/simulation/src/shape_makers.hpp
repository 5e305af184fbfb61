#pragma once

#include <cstdint>

#include "gelslam/simulation/shape.hpp"

namespace gelslam::simulation::detail {

/// The dials that every procedural shape has (ShapeSpec, checked).
struct ShapeDials {
  float size = 1;
  float texture = 1;
  std::uint32_t seed = 1;
};

ShapePtr make_sphere(const ShapeDials& dials);
ShapePtr make_pebble(const ShapeDials& dials);
ShapePtr make_peanut(const ShapeDials& dials);
ShapePtr make_golf_ball(const ShapeDials& dials);
ShapePtr make_knurl(const ShapeDials& dials);
ShapePtr make_screw(const ShapeDials& dials);
ShapePtr make_coin(const ShapeDials& dials);
ShapePtr make_plank(const ShapeDials& dials);

/// A ball of any radius, exact (for calibration presses).
ShapePtr make_ball(float radius_mm);

inline Eigen::AlignedBox3f centered_box(const Eigen::Vector3f& half) { return {-half, half}; }

/// Distance to an axis-aligned ellipsoid, exact on the surface (Quilez' bound).
inline float ellipsoid_distance(const Eigen::Vector3f& point, const Eigen::Vector3f& radii) {
  const float k0 = point.cwiseQuotient(radii).norm();
  const float k1 = point.cwiseQuotient(radii.cwiseProduct(radii)).norm();
  return k1 < 1e-6F ? -radii.minCoeff() : k0 * (k0 - 1.0F) / k1;
}

/// 0 below `low`, 1 above `high`, smooth between.
inline float smooth_step(float low, float high, float x) {
  const float t = std::fmin(std::fmax((x - low) / (high - low), 0.0F), 1.0F);
  return t * t * (3.0F - 2.0F * t);
}

/// Gradient noise (Perlin 1985, quintic fade 2002) on the integer lattice, about -1 .. 1, smooth to the
/// second derivative. Different seeds give unrelated fields.
float gradient_noise(const Eigen::Vector3f& point, std::uint32_t seed);

}  // namespace gelslam::simulation::detail
