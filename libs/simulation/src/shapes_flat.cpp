// Flat objects: coin and plank. They are placed on the sensor with the face that points along +z.

#include <algorithm>
#include <array>
#include <numbers>

#include "random.hpp"
#include "shape_makers.hpp"

namespace gelslam::simulation::detail {
namespace {

using Eigen::Vector2f;
using Eigen::Vector3f;

/// A plank: a box with slightly rounded edges below z = 0. Lengthwise cut growth rings and fibers form the
/// relief of its face.
class Plank final : public ImplicitShape {
 public:
  explicit Plank(const ShapeDials& dials)
      : ImplicitShape(ShapeKind::flat, bounds(dials), {0, high(dials), 1.1F + 0.7F * dials.texture}),
        half_(half(dials)),
        dials_(dials) {}

 private:
  static constexpr float kRounding = 0.5F;
  static float high(const ShapeDials& dials) { return 0.3F * dials.texture; }
  static Vector3f half(const ShapeDials& dials) { return dials.size * Vector3f(22, 16, 3); }
  static Eigen::AlignedBox3f bounds(const ShapeDials& dials) {
    const Vector3f half = Plank::half(dials);
    const float high = Plank::high(dials);
    return {Vector3f(-half.x() - high, -half.y() - high, -2 * half.z() - high),
            Vector3f(half.x() + high, half.y() + high, high)};
  }
  float base(const Vector3f& point) const override {
    const Vector3f q = (point + Vector3f(0, 0, half_.z())).cwiseAbs() - half_ + Vector3f::Constant(kRounding);
    return q.cwiseMax(0.0F).norm() + std::fmin(q.maxCoeff(), 0.0F) - kRounding;
  }
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
  Vector3f half_;
  ShapeDials dials_;
};

/// A disk with a rim, a ring of beads, strokes that resemble letters, and a modeled center.
class Coin final : public ImplicitShape {
 public:
  explicit Coin(const ShapeDials& dials)
      : ImplicitShape(ShapeKind::flat, bounds(dials), {0, high(dials), 1.1F + 0.9F * dials.texture}),
        dials_(dials) {
    Random random(dials.seed);
    for (Glyph& glyph : glyphs_)
      for (Vector2f& end : glyph)
        end.y() = static_cast<float>(random.uniform(-1, 1)),
        end.x() = static_cast<float>(random.uniform(-0.75, 0.75));
  }

 private:
  static constexpr int kGlyphCount = 22, kStrokeEnds = 4;
  static constexpr float kDiscRadius = 12.0F, kThickness = 2.0F, kLettersAt = 8.1F;
  /// A line through four points, relative to its own center, mm.
  using Glyph = std::array<Vector2f, kStrokeEnds>;

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
    // The back has its letters in another order, and another center.
    const bool back = point.z() < -0.5F * kThickness;
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

}  // namespace

ShapePtr make_coin(const ShapeDials& dials) { return std::make_shared<Coin>(dials); }
ShapePtr make_plank(const ShapeDials& dials) { return std::make_shared<Plank>(dials); }

}  // namespace gelslam::simulation::detail
