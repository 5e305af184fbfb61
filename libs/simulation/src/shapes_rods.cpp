// Rods along x: knurled rod, screw.

#include <algorithm>
#include <numbers>

#include "shape_makers.hpp"

namespace gelslam::simulation::detail {
namespace {

using Eigen::Vector3f;

/// A cylinder along x with flat ends.
class Rod : public ImplicitShape {
 public:
  Rod(float radius, float half_length, const Limits& limits)
      : ImplicitShape(ShapeKind::rod, bounds(radius, half_length, limits), limits),
        radius_(radius),
        half_length_(half_length) {}

 protected:
  float radius() const { return radius_; }

 private:
  static Eigen::AlignedBox3f bounds(float radius, float half_length, const Limits& limits) {
    const float across = radius + limits.texture_high;
    return centered_box(Vector3f(half_length + limits.texture_high, across, across));
  }
  float base(const Vector3f& point) const override {
    const float across = std::hypot(point.y(), point.z()) - radius_;
    const float along = std::fabs(point.x()) - half_length_;
    const float outside = std::hypot(std::fmax(across, 0.0F), std::fmax(along, 0.0F));
    return std::fmin(std::fmax(across, along), 0.0F) + outside;
  }
  float radius_, half_length_;
};

/// Two sets of helical grooves that cross each other leave diamonds, each slightly different.
class Knurl final : public Rod {
 public:
  explicit Knurl(const ShapeDials& dials)
      : Rod(5.5F * dials.size, 15.0F * dials.size, {0, high(dials), 1.1F + 0.75F * dials.texture}),
        dials_(dials) {}

 private:
  static constexpr float kDepth = 0.22F, kWear = 0.05F;
  static float high(const ShapeDials& dials) { return (kDepth + kWear) * dials.texture; }
  float texture(const Vector3f& point) const override {
    const float angle = std::atan2(point.z(), point.y());
    const float teeth = std::fmax(6.0F, std::round(20.0F * dials_.size));
    const float along = teeth / radius() * point.x();
    const float u = 0.5F + 0.5F * std::cos(teeth * angle + along);
    const float v = 0.5F + 0.5F * std::cos(teeth * angle - along);
    const float worn = 0.5F * kWear * (1 + gradient_noise(point * 0.9F, dials_.seed));
    return std::clamp(dials_.texture * (kDepth * std::sqrt(u * v + 0.003F) + worn), 0.0F, high(dials_));
  }
  ShapeDials dials_;
};

class Screw final : public Rod {
 public:
  explicit Screw(const ShapeDials& dials)
      : Rod(4.5F * dials.size, 15.0F * dials.size, {0, high(dials), 1.1F + 1.3F * dials.texture}),
        dials_(dials) {}

 private:
  static constexpr float kDepth = 0.4F, kPitch = 1.5F, kWear = 0.03F;
  static float high(const ShapeDials& dials) { return (kDepth + kWear) * dials.texture; }
  float texture(const Vector3f& point) const override {
    const float angle = std::atan2(point.z(), point.y());
    const float phase = 2 * std::numbers::pi_v<float> * point.x() / kPitch + angle;
    const float thread = 0.5F + 0.5F * std::cos(phase);
    const float worn = 0.5F * kWear * (1 + gradient_noise(point * 1.2F, dials_.seed));
    return std::clamp(dials_.texture * (kDepth * thread + worn), 0.0F, high(dials_));
  }
  ShapeDials dials_;
};

}  // namespace

ShapePtr make_knurl(const ShapeDials& dials) { return std::make_shared<Knurl>(dials); }
ShapePtr make_screw(const ShapeDials& dials) { return std::make_shared<Screw>(dials); }

}  // namespace gelslam::simulation::detail
