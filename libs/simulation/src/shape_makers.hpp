#pragma once

#include <cmath>
#include <cstdint>

#include "gelslam/simulation/shape.hpp"

namespace gelslam::simulation::detail {

/// A shape defined by a base distance function and a texture that raises or lowers its surface along the
/// distance: value(p) = base(p) - texture(p), negative inside.
class ImplicitShape : public Shape {
 public:
  struct Limits {
    float texture_low = 0, texture_high = 0;  ///< bounds of texture(), mm
    float lipschitz = 1.2F;                   ///< |value(p)| <= lipschitz * distance from p to the surface
  };

  ImplicitShape(ShapeKind kind, const Eigen::AlignedBox3f& bounds, const Limits& limits)
      : kind_(kind), bounds_(bounds), limits_(limits) {}

  ShapeKind kind() const override { return kind_; }
  Eigen::AlignedBox3f bounds_mm() const override { return bounds_; }
  float intersect(const Eigen::Vector3f& origin, const Eigen::Vector3f& direction,
                  float t_max) const override;
  float intersect_near(const Eigen::Vector3f& origin, const Eigen::Vector3f& direction,
                       float guess) const override;
  float clearance(const Eigen::Vector3f& point) const override;
  Mesh mesh(float spacing_mm) const override;

  /// Returns the value in mm, negative inside. The texture is evaluated only where it can change the sign.
  float value(const Eigen::Vector3f& point) const;
  Eigen::Vector3f gradient(const Eigen::Vector3f& point) const;
  float lipschitz() const { return limits_.lipschitz; }

 protected:
  virtual float base(const Eigen::Vector3f& point) const = 0;
  virtual float texture(const Eigen::Vector3f& point) const = 0;

 private:
  /// Returns the intersection between a point outside and one inside, whose values are given.
  float refine(const Eigen::Vector3f& origin, const Eigen::Vector3f& direction, float outside,
               float f_outside, float inside, float f_inside) const;

  ShapeKind kind_;
  Eigen::AlignedBox3f bounds_;
  Limits limits_;
};

/// Returns the zero level of `shape` as a closed mesh (after Gibson's surface nets, 1998), with the vertices
/// moved onto the surface.
Mesh surface_nets(const ImplicitShape& shape, float spacing_mm);

/// Parameters of every procedural shape (from a checked ShapeSpec).
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

/// A ball of any radius without approximation (for calibration presses).
ShapePtr make_ball(float radius_mm);

inline Eigen::AlignedBox3f centered_box(const Eigen::Vector3f& half) { return {-half, half}; }

/// Distance to an axis-aligned ellipsoid, exact on the surface only (Quilez' bound).
inline float ellipsoid_distance(const Eigen::Vector3f& point, const Eigen::Vector3f& radii) {
  const float k0 = point.cwiseQuotient(radii).norm();
  const float k1 = point.cwiseQuotient(radii.cwiseProduct(radii)).norm();
  return k1 < 1e-6F ? -radii.minCoeff() : k0 * (k0 - 1.0F) / k1;
}

/// 0 below `low`, 1 above `high`, and a smooth transition between them.
inline float smooth_step(float low, float high, float x) {
  const float t = std::fmin(std::fmax((x - low) / (high - low), 0.0F), 1.0F);
  return t * t * (3.0F - 2.0F * t);
}

/// Gradient noise (Perlin 1985, quintic fade 2002) on the integer lattice, with values of about -1 .. 1 and
/// continuous second derivatives. Different seeds give unrelated functions.
float gradient_noise(const Eigen::Vector3f& point, std::uint32_t seed);

}  // namespace gelslam::simulation::detail
