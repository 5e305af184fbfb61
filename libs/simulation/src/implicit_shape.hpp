#pragma once

#include "gelslam/simulation/shape.hpp"

namespace gelslam::simulation::detail {

/// A shape given by a base distance function and a texture that raises (or lowers) its surface along it:
/// value(p) = base(p) - texture(p), negative inside.
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

  /// Negative inside, mm. The texture is evaluated only where it can decide the sign.
  float value(const Eigen::Vector3f& point) const;
  Eigen::Vector3f gradient(const Eigen::Vector3f& point) const;
  float lipschitz() const { return limits_.lipschitz; }

 protected:
  virtual float base(const Eigen::Vector3f& point) const = 0;
  virtual float texture(const Eigen::Vector3f& point) const = 0;

 private:
  /// The crossing between a point outside and one inside, given the values there.
  float refine(const Eigen::Vector3f& origin, const Eigen::Vector3f& direction, float outside,
               float f_outside, float inside, float f_inside) const;

  ShapeKind kind_;
  Eigen::AlignedBox3f bounds_;
  Limits limits_;
};

/// The zero level of `shape` as a closed mesh (own, after Gibson's surface nets, 1998), vertices moved onto
/// the surface.
Mesh surface_nets(const ImplicitShape& shape, float spacing_mm);

}  // namespace gelslam::simulation::detail
