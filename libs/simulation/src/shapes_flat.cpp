// Flat objects that lie on the sensor with the face that looks along +z: plane, coin, plank, weave, blade.

#include <algorithm>
#include <array>
#include <numbers>

#include "implicit_shape.hpp"
#include "random.hpp"
#include "shape_makers.hpp"

namespace gelslam::simulation::detail {
namespace {

using Eigen::Vector2f;
using Eigen::Vector3f;

/// A box with slightly rounded edges below z = 0; its texture rises from the face.
class Slab : public ImplicitShape {
 public:
  Slab(const Vector3f& half, const Limits& limits)
      : ImplicitShape(ShapeKind::flat, bounds(half, limits.texture_high), limits), half_(half) {}

 private:
  static constexpr float kRounding = 0.5F;
  static Eigen::AlignedBox3f bounds(const Vector3f& half, float high) {
    return {Vector3f(-half.x() - high, -half.y() - high, -2 * half.z() - high),
            Vector3f(half.x() + high, half.y() + high, high)};
  }
  float base(const Vector3f& point) const override {
    const Vector3f q = (point + Vector3f(0, 0, half_.z())).cwiseAbs() - half_ + Vector3f::Constant(kRounding);
    return q.cwiseMax(0.0F).norm() + std::fmin(q.maxCoeff(), 0.0F) - kRounding;
  }
  float texture(const Vector3f&) const override { return 0; }
  Vector3f half_;
};

/// Growth rings cut lengthwise, and fibres.
class Plank final : public Slab {
 public:
  explicit Plank(const ShapeDials& dials)
      : Slab(dials.size * Vector3f(22, 16, 3), {0, high(dials), 1.1F + 0.7F * dials.texture}),
        dials_(dials) {}

 private:
  static float high(const ShapeDials& dials) { return 0.3F * dials.texture; }
  float texture(const Vector3f& point) const override {
    const float x = point.x(), y = point.y();
    const float bend = 2.2F * gradient_noise(Vector3f(0.06F * x, 0.1F * y, 0.5F), dials_.seed) +
                       0.25F * gradient_noise(Vector3f(0.3F * x, 0.5F * y, 1.5F), dials_.seed + 1);
    const float ring = 0.5F + 0.5F * std::sin(2 * std::numbers::pi_v<float> * (0.42F * y + bend));
    const float fibre = gradient_noise(Vector3f(0.35F * x, 2.4F * y, 2.5F), dials_.seed + 2);
    const float pore = gradient_noise(Vector3f(0.7F * x, 1.3F * y, 3.5F), dials_.seed + 3);
    return std::clamp(dials_.texture * (0.05F + 0.14F * ring + 0.035F * fibre + 0.06F * pore), 0.0F,
                      high(dials_));
  }
  ShapeDials dials_;
};

/// Plain weave: the same patch again every two threads.
class Weave final : public Slab {
 public:
  explicit Weave(const ShapeDials& dials)
      : Slab(dials.size * Vector3f(22, 16, 3), {0, high(dials), 1.1F + 0.9F * dials.texture}),
        dials_(dials) {}

 private:
  static constexpr float kThreadMm = 1.6F;
  static float high(const ShapeDials& dials) { return 0.35F * dials.texture; }
  float texture(const Vector3f& point) const override {
    const float u = std::numbers::pi_v<float> * point.x() / kThreadMm;
    const float v = std::numbers::pi_v<float> * point.y() / kThreadMm;
    const float over = 0.5F * std::cos(u) * std::cos(v);
    const float warp = std::cos(v) * std::cos(v) * (0.5F + over);
    const float weft = std::cos(u) * std::cos(u) * (0.5F - over);
    const float difference = warp - weft;
    const float top = 0.5F * (warp + weft + std::sqrt(difference * difference + 0.004F));
    return std::clamp(0.3F * dials_.texture * top, 0.0F, high(dials_));
  }
  ShapeDials dials_;
};

/// A disc with a rim, a ring of beads, strokes like letters and a modeled center.
class Coin final : public ImplicitShape {
 public:
  explicit Coin(const ShapeDials& dials)
      : ImplicitShape(ShapeKind::flat, bounds(dials), {0, high(dials), 1.1F + 0.9F * dials.texture}),
        dials_(dials) {
    Random random(dials.seed);
    for (Glyph& glyph : glyphs_)
      for (Vector2f& end : glyph)
        end = Vector2f(static_cast<float>(random.uniform(-0.75, 0.75)),
                       static_cast<float>(random.uniform(-1, 1)));
  }

 private:
  static constexpr int kGlyphCount = 22, kStrokeEnds = 4;
  static constexpr float kDiscRadius = 12.0F, kThickness = 2.0F, kLettersAt = 8.1F;
  using Glyph = std::array<Vector2f, kStrokeEnds>;  ///< a line through four points, about its own center, mm

  static float high(const ShapeDials& dials) { return 0.36F * dials.texture; }
  static Eigen::AlignedBox3f bounds(const ShapeDials& dials) {
    const float r = kDiscRadius * dials.size + high(dials);
    return {Vector3f(-r, -r, -kThickness - high(dials)), Vector3f(r, r, high(dials))};
  }
  float base(const Vector3f& point) const override {
    constexpr float kRounding = 0.4F;
    const float across = std::hypot(point.x(), point.y()) - kDiscRadius * dials_.size + kRounding;
    const float along = std::fabs(point.z() + 0.5F * kThickness) - 0.5F * kThickness + kRounding;
    const float outside = std::hypot(std::fmax(across, 0.0F), std::fmax(along, 0.0F));
    return std::fmin(std::fmax(across, along), 0.0F) + outside - kRounding;
  }
  float letters(float r, float angle) const {
    const float turn = (angle / (2 * std::numbers::pi_v<float>)+0.5F) * kGlyphCount;
    const int index = std::clamp(static_cast<int>(turn), 0, kGlyphCount - 1);
    const float along =
        (turn - static_cast<float>(index) - 0.5F) * (2 * std::numbers::pi_v<float> * r / kGlyphCount);
    const Vector2f here(along, r - kLettersAt);
    float nearest = 10;
    const Glyph& glyph = glyphs_[static_cast<std::size_t>(index)];
    for (std::size_t k = 0; k + 1 < glyph.size(); ++k) {
      const Vector2f stroke = glyph[k + 1] - glyph[k];
      const float t = std::clamp((here - glyph[k]).dot(stroke) / (stroke.squaredNorm() + 1e-6F), 0.0F, 1.0F);
      nearest = std::fmin(nearest, (here - glyph[k] - t * stroke).norm());
    }
    return 0.15F * (1 - smooth_step(0.1F, 0.34F, nearest));
  }
  float texture(const Vector3f& point) const override {
    const bool back = point.z() < -0.5F * kThickness;  // letters in another order, another head
    const Vector3f p(point.x() / dials_.size, point.y() / dials_.size, back ? 7.5F : 0.5F);
    const float r = std::hypot(p.x(), p.y()), angle = std::atan2(p.y(), p.x());
    float height = 0.22F * (1 - smooth_step(0.25F, 0.7F, std::fabs(r - 11.2F)));
    const float bead = 0.5F + 0.5F * std::cos(56 * angle);
    height += 0.14F * bead * (1 - smooth_step(0.15F, 0.5F, std::fabs(r - 10.1F)));
    if (r > 6.4F && r < 9.8F) height += letters(r, angle);
    const float field =
        gradient_noise(p * 0.3F, dials_.seed) + 0.35F * gradient_noise(p * 0.8F, dials_.seed + 1);
    const float head =
        smooth_step(-0.15F, 0.25F, field) * 0.17F + 0.05F * gradient_noise(p * 1.3F, dials_.seed + 2);
    height += head * (1 - smooth_step(5.0F, 6.2F, r));
    return std::clamp(dials_.texture * height, 0.0F, high(dials_));
  }

  ShapeDials dials_;
  std::array<Glyph, kGlyphCount> glyphs_{};
};

/// A blade along x. Its section is all circles about a cambered line (rounded edges, and a tip as round, come
/// with them); it turns from root to tip. Tool marks run along x, never quite straight or equally deep.
class Blade final : public ImplicitShape {
 public:
  explicit Blade(const ShapeDials& dials)
      : ImplicitShape(ShapeKind::flat, bounds(dials), {0, high(dials), 1.1F + 0.35F * dials.texture}),
        dials_(dials) {}

 private:
  static constexpr float kHalfSpan = 20, kHalfChord = 11, kCamber = 0.8F;
  static constexpr float kTwistPerMm = 0.006F;  ///< radians, at size 1

  static float high(const ShapeDials& dials) { return 0.06F * dials.texture; }
  static Eigen::AlignedBox3f bounds(const ShapeDials& dials) {
    const Vector3f high = Vector3f::Constant(Blade::high(dials));
    return {dials.size * Vector3f(-21.5F, -11.5F, -2.1F) - high,
            dials.size * Vector3f(21.5F, 11.9F, 2.7F) + high};
  }
  /// As if it were not twisted, at size 1.
  Vector3f untwisted(const Vector3f& point) const {
    const Vector3f p = point / dials_.size;
    const float angle = kTwistPerMm * std::clamp(p.x(), -kHalfSpan, kHalfSpan);
    return Eigen::AngleAxisf(-angle, Vector3f::UnitX()) * p;
  }
  /// Radius of the circle at `s`, -1 at the trailing edge, 1 at the leading one.
  static float radius(float s) { return 0.475F + 0.225F * s + (1 - s * s); }

  float base(const Vector3f& point) const override {
    const Vector3f p = untwisted(point);
    const float beyond = std::fmax(std::fabs(p.x()) - kHalfSpan, 0.0F);
    float s = std::clamp(p.y() / kHalfChord, -1.0F, 1.0F);
    const auto from_center = [&] { return Vector2f(p.y() - kHalfChord * s, p.z() - kCamber * (1 - s * s)); };
    // Each step finds the nearest circle as if line and radius were straight from here on.
    for (int k = 0; k < 3; ++k) {
      const Vector2f tangent(kHalfChord, -2 * kCamber * s), offset = from_center();
      const float length = tangent.norm(), growth = (0.225F - 2 * s) / length;
      const float across = (tangent.x() * offset.y() - tangent.y() * offset.x()) / length;
      const float lean = std::hypot(across, beyond) * growth / std::sqrt(1 - growth * growth);
      s = std::clamp(s + (tangent.dot(offset) / length + lean) / length, -1.0F, 1.0F);
    }
    return dials_.size * (std::hypot(from_center().norm(), beyond) - radius(s));
  }
  float texture(const Vector3f& point) const override {
    const Vector3f p = dials_.size * untwisted(point);
    const auto noise = [&](float along, float across, std::uint32_t k) {
      return gradient_noise(Vector3f(along * p.x(), across * p.y(), across * p.z()), dials_.seed + k);
    };
    const float row = 2 * std::numbers::pi_v<float> * (p.y() + 0.5F * noise(0.15F, 0.4F, 0));
    const float mark = (0.5F + 0.5F * std::cos(row)) * (1 + 0.5F * noise(0.3F, 0.6F, 1));
    return std::clamp(dials_.texture * (0.01F + 0.025F * mark + 0.02F * noise(0.9F, 0.9F, 2)), 0.0F,
                      high(dials_));
  }
  ShapeDials dials_;
};

}  // namespace

ShapePtr make_plane(const ShapeDials& dials) {
  return std::make_shared<Slab>(dials.size * Vector3f(22, 16, 3), ImplicitShape::Limits{0, 0, 1.0F});
}
ShapePtr make_coin(const ShapeDials& dials) { return std::make_shared<Coin>(dials); }
ShapePtr make_plank(const ShapeDials& dials) { return std::make_shared<Plank>(dials); }
ShapePtr make_weave(const ShapeDials& dials) { return std::make_shared<Weave>(dials); }
ShapePtr make_blade(const ShapeDials& dials) { return std::make_shared<Blade>(dials); }

}  // namespace gelslam::simulation::detail
