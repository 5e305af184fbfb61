// Round bodies: sphere, pebble, peanut, golf ball.

#include <algorithm>
#include <array>
#include <numbers>
#include <vector>

#include "shape_makers.hpp"

namespace gelslam::simulation::detail {
namespace {

using Eigen::Vector3f;

class Sphere final : public ImplicitShape {
 public:
  explicit Sphere(float radius)
      : ImplicitShape(ShapeKind::body, centered_box(Vector3f::Constant(radius)), {0, 0, 1.0F}),
        radius_(radius) {}

 private:
  float base(const Vector3f& point) const override { return point.norm() - radius_; }
  float texture(const Vector3f&) const override { return 0; }
  float radius_;
};

/// An ellipsoid with dents, bumps of a millimeter and a fine grain.
class Pebble final : public ImplicitShape {
 public:
  Pebble(const Vector3f& radii, const ShapeDials& dials)
      : ImplicitShape(ShapeKind::body, centered_box(radii.array() + reach(dials)),
                      {-reach(dials), reach(dials), 1.3F + 0.45F * dials.texture}),
        radii_(radii),
        dials_(dials) {}

 private:
  static float reach(const ShapeDials& dials) { return 0.5F * dials.size + 0.3F * dials.texture; }
  float base(const Vector3f& point) const override { return ellipsoid_distance(point, radii_); }
  float texture(const Vector3f& point) const override {
    const float lumps = 0.5F * dials_.size * gradient_noise(point * (0.16F / dials_.size), dials_.seed);
    const float bumps = 0.16F * gradient_noise(point * 0.62F, dials_.seed + 1);
    const float grain = 0.07F * gradient_noise(point * 1.45F, dials_.seed + 2);
    const float dust = 0.02F * gradient_noise(point * 3.3F, dials_.seed + 3);
    return std::clamp(lumps + dials_.texture * (bumps + grain + dust), -reach(dials_), reach(dials_));
  }
  Vector3f radii_;
  ShapeDials dials_;
};

/// Two lobes with a waist between them, and ridges along and across, like the shell of a peanut.
class Peanut final : public ImplicitShape {
 public:
  explicit Peanut(const ShapeDials& dials)
      : ImplicitShape(
            ShapeKind::body,
            centered_box(dials.size * Vector3f(12.6F, 7.4F, 7.4F) + Vector3f::Constant(high(dials))),
            {low(dials), high(dials), 1.15F + 0.5F * dials.texture}),
        dials_(dials) {}

 private:
  static float low(const ShapeDials& dials) { return -0.35F * dials.texture - 0.05F; }
  static float high(const ShapeDials& dials) { return 0.3F * dials.texture + 0.05F; }
  float base(const Vector3f& point) const override {
    const Vector3f p = point / dials_.size;
    const float a = (p - Vector3f(-5.4F, 0.2F, 0)).norm() - 6.6F;
    const float b = (p - Vector3f(5.8F, -0.2F, 0.1F)).norm() - 6.1F;
    const float blend = 3.0F;
    const float h = std::fmax(blend - std::fabs(a - b), 0.0F) / blend;
    return dials_.size * (std::fmin(a, b) - 0.25F * h * h * blend);
  }
  float texture(const Vector3f& point) const override {
    const Vector3f stretched(point.x() * 0.22F, point.y() * 0.42F, point.z() * 0.42F);
    const float field = gradient_noise(stretched, dials_.seed);
    // Ridges run where the field changes its sign.
    const float net = 0.5F - 1.6F * std::sqrt(field * field + 0.003F);
    const float bumps = gradient_noise(point * 0.8F, dials_.seed + 1);
    const float grain = gradient_noise(point * 1.9F, dials_.seed + 2);
    return std::clamp(dials_.texture * (0.3F * net + 0.09F * bumps + 0.04F * grain), low(dials_),
                      high(dials_));
  }
  ShapeDials dials_;
};

/// A golf ball whose dimples form a Fibonacci lattice. The dimples near a point are looked up in a table over
/// the faces of a cube.
class GolfBall final : public ImplicitShape {
 public:
  explicit GolfBall(const ShapeDials& dials)
      : ImplicitShape(ShapeKind::body, centered_box(Vector3f::Constant(kBallRadius * dials.size)),
                      {-kDimpleDepth * dials.texture - kScratchMm, 0, 1.1F + 0.35F * dials.texture}),
        radius_(kBallRadius * dials.size),
        dials_(dials) {
    for (int k = 0; k < kDimples; ++k) {
      const double z = 1.0 - (2.0 * k + 1.0) / kDimples;
      const double angle = k * std::numbers::pi * (3.0 - std::sqrt(5.0)) + dials.seed;
      const double r = std::sqrt(1.0 - z * z);
      centers_.push_back(Eigen::Vector3d(r * std::cos(angle), r * std::sin(angle), z).cast<float>());
    }
    for (int bin = 0; bin < kBins; ++bin) fill_bin(bin);
  }

 private:
  static constexpr float kBallRadius = 21.35F, kDimpleDepth = 0.22F, kScratchMm = 0.03F;
  static constexpr int kDimples = 332, kSide = 24, kBins = 6 * kSide * kSide, kCandidates = 5;

  static int bin_of(const Vector3f& d) {
    int axis = 0;
    const float largest = d.cwiseAbs().maxCoeff(&axis);
    const float a = d[(axis + 1) % 3] / largest, b = d[(axis + 2) % 3] / largest;
    const int ia = std::clamp(static_cast<int>((a + 1) * 0.5F * kSide), 0, kSide - 1);
    const int ib = std::clamp(static_cast<int>((b + 1) * 0.5F * kSide), 0, kSide - 1);
    return ((2 * axis + (d[axis] < 0 ? 1 : 0)) * kSide + ia) * kSide + ib;
  }
  static Vector3f bin_center(int bin) {
    const int face = bin / (kSide * kSide), ia = bin / kSide % kSide, ib = bin % kSide, axis = face / 2;
    Vector3f d;
    d[axis] = face % 2 == 0 ? 1.0F : -1.0F;
    d[(axis + 1) % 3] = (static_cast<float>(ia) + 0.5F) / kSide * 2 - 1;
    d[(axis + 2) % 3] = (static_cast<float>(ib) + 0.5F) / kSide * 2 - 1;
    return d.normalized();
  }
  void fill_bin(int bin) {
    const Vector3f center = bin_center(bin);
    std::vector<std::pair<float, int>> order;
    for (int k = 0; k < kDimples; ++k)
      order.emplace_back(-center.dot(centers_[static_cast<std::size_t>(k)]), k);
    std::partial_sort(order.begin(), order.begin() + kCandidates, order.end());
    for (std::size_t k = 0; k < kCandidates; ++k) table_[static_cast<std::size_t>(bin)][k] = order[k].second;
  }

  float base(const Vector3f& point) const override { return point.norm() - radius_; }
  float texture(const Vector3f& point) const override {
    const Vector3f direction = point.normalized();
    float nearest = -1;
    for (const int k : table_[static_cast<std::size_t>(bin_of(direction))])
      nearest = std::fmax(nearest, direction.dot(centers_[static_cast<std::size_t>(k)]));
    const float distance = radius_ * std::sqrt(std::fmax(0.0F, 2 - 2 * nearest));
    const float rim = 1.85F * dials_.size;
    const float dimple = kDimpleDepth * (1 - smooth_step(0.2F * rim, rim, distance));
    const float scratch = 0.5F * kScratchMm * (1 + gradient_noise(point * 1.1F, dials_.seed + 1));
    return -dials_.texture * dimple - std::clamp(scratch * std::fmin(dials_.texture, 1.0F), 0.0F, kScratchMm);
  }

  float radius_;
  ShapeDials dials_;
  std::vector<Vector3f> centers_;
  std::array<std::array<int, kCandidates>, kBins> table_{};
};

}  // namespace

ShapePtr make_ball(float radius_mm) { return std::make_shared<Sphere>(radius_mm); }
ShapePtr make_sphere(const ShapeDials& dials) { return make_ball(8.0F * dials.size); }
ShapePtr make_pebble(const ShapeDials& dials) {
  return std::make_shared<Pebble>(dials.size * Vector3f(10.5F, 8.5F, 7.0F), dials);
}
ShapePtr make_peanut(const ShapeDials& dials) { return std::make_shared<Peanut>(dials); }
ShapePtr make_golf_ball(const ShapeDials& dials) { return std::make_shared<GolfBall>(dials); }

}  // namespace gelslam::simulation::detail
