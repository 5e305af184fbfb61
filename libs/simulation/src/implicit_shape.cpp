// Where rays meet a shape that is given by an implicit function (sphere tracing: Hart, The Visual Computer
// 1996).
//
// value(p) is zero on the surface, and the distance from p to the surface is at least value(p) / lipschitz,
// so a ray can always advance by that much. Close to the surface these steps become very small. There the
// step is that of the secant method, up to four times as long, with the rate at which the value decreased in
// the previous step. When a step has passed the surface, refine() finds the zero between its ends.
// Limitation: a sheet that is thinner than such a step may be missed.
// may be missed.

#include <algorithm>
#include <cmath>
#include <limits>

#include "shape_makers.hpp"

namespace gelslam::simulation::detail {
namespace {

constexpr float kTextureMarginMm = 0.02F;
constexpr float kNearMm = 0.06F;  ///< Below this value the steps are those of the secant method.
constexpr float kSmallestStepMm = 3e-4F;
constexpr float kPrecisionMm = 1e-5F;

}  // namespace

float ImplicitShape::value(const Eigen::Vector3f& point) const {
  const float distance = base(point);
  if (distance > limits_.texture_high + kTextureMarginMm) return distance - limits_.texture_high;
  if (distance < limits_.texture_low - kTextureMarginMm) return distance - limits_.texture_low;
  return distance - texture(point);
}

Eigen::Vector3f ImplicitShape::gradient(const Eigen::Vector3f& point) const {
  constexpr float step = 4e-3F;  // At 20 mm a float has a resolution of about 1e-6 mm, 0.03 % of the step.
  Eigen::Vector3f result;
  for (int axis = 0; axis < 3; ++axis) {
    const Eigen::Vector3f shift = step * Eigen::Vector3f::Unit(axis);
    result[axis] = (value(point + shift) - value(point - shift)) / (2 * step);
  }
  return result;
}

float ImplicitShape::clearance(const Eigen::Vector3f& point) const {
  return std::max(0.0F, value(point) / limits_.lipschitz);
}

float ImplicitShape::refine(const Eigen::Vector3f& origin, const Eigen::Vector3f& direction, float outside,
                            float f_outside, float inside, float f_inside) const {
  for (int k = 0; k < 20 && inside - outside > kPrecisionMm; ++k) {
    // The position is kept away from both ends, so that the bracket shrinks from both sides.
    const float share = std::clamp(f_outside / (f_outside - f_inside), 0.05F, 0.95F);
    const float middle = outside + share * (inside - outside), f_middle = value(origin + middle * direction);
    if (std::abs(f_middle) < kPrecisionMm) return middle;
    (f_middle > 0 ? outside : inside) = middle;
    (f_middle > 0 ? f_outside : f_inside) = f_middle;
  }
  return 0.5F * (outside + inside);
}

float ImplicitShape::intersect(const Eigen::Vector3f& origin, const Eigen::Vector3f& direction,
                               float t_max) const {
  float t = 0, f = value(origin);
  if (f <= 0) return 0;
  float fall = limits_.lipschitz;  // Rate at which the value decreased along the ray in the previous step.
  while (t < t_max) {
    const float safe = f / limits_.lipschitz;
    const float step = f < kNearMm ? std::min(f / fall, 4 * safe) + kSmallestStepMm : safe;
    const float t_next = t + step, f_next = value(origin + t_next * direction);
    if (f_next <= 0) {
      const float hit = refine(origin, direction, t, f, t_next, f_next);
      return hit <= t_max ? hit : std::numeric_limits<float>::infinity();
    }
    fall = std::clamp((f - f_next) / step, 0.3F, limits_.lipschitz);
    t = t_next;
    f = f_next;
  }
  return std::numeric_limits<float>::infinity();
}

float ImplicitShape::intersect_near(const Eigen::Vector3f& origin, const Eigen::Vector3f& direction,
                                    float guess) const {
  constexpr float far_off_mm = 0.1F, close_mm = 3e-4F;
  float t = guess, f = value(origin + t * direction);
  // A surface that touches the gel faces it, so the value decreases nearly as fast as the distance.
  float fall = 0.95F;
  for (int k = 0; k < 3; ++k) {
    if (std::abs(f) > far_off_mm) break;
    if (std::abs(f) < kPrecisionMm) return t;
    const float t_next = t + f / fall, f_next = value(origin + t_next * direction);
    const float slope = (f - f_next) / (t_next - t);
    // With any other slope the ray does not simply enter a single sheet here.
    if (!(slope > 0.3F && slope < 2 * limits_.lipschitz)) break;
    if (std::abs(f_next) < close_mm) return t_next + f_next / slope;
    t = t_next, f = f_next, fall = slope;
  }
  return std::numeric_limits<float>::quiet_NaN();
}

Mesh ImplicitShape::mesh(float spacing_mm) const { return surface_nets(*this, spacing_mm); }

}  // namespace gelslam::simulation::detail
