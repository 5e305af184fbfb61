// The inner loops of NormalFlow: residuals of normals at a pose, robust weights, and normal equations (Huang
// et al., RA-L 2024, §IV). They are compiled for several instruction sets, of which one is chosen at run
// time.

#include "normal_flow_kernels.hpp"

#include <algorithm>
#include <cstdint>
#include <cstring>

#include "gelslam/core/target_clones.hpp"
#include "gelslam/surface/surface.hpp"

namespace gelslam::registration::detail {
namespace {

using Float4 = float __attribute__((vector_size(16)));

// Sums are accumulated in 64 independent lanes, so that the order of additions, and therefore the result,
// does not depend on the width of the processor's vectors. Samples are processed in blocks of 64, which fit
// into the first-level cache.
constexpr int kLanes = 64;

GELSLAM_CLONES float weighted_sum(const float* __restrict w, const float* __restrict a, int count) {
  float lanes[kLanes] = {};
  int i = 0;
  for (; i + kLanes <= count; i += kLanes)
    for (int k = 0; k < kLanes; ++k) lanes[k] += w[i + k] * a[i + k];
  for (int k = 0; i < count; ++i, ++k) lanes[k] += w[i] * a[i];
  float sum = 0;
  for (int k = 0; k < kLanes; ++k) sum += lanes[k];
  return sum;
}

/// Adds Σ w |r|² to `squares`, and Σ w to `weights`.
GELSLAM_CLONES void add_squares(const float* __restrict w, const float* __restrict rx,
                                const float* __restrict ry, const float* __restrict rz, int count,
                                float& squares, float& weights) {
  float square_lanes[kLanes] = {}, weight_lanes[kLanes] = {};
  const auto add = [&](int i, int k) __attribute__((always_inline)) {
    square_lanes[k] += w[i] * (rx[i] * rx[i] + ry[i] * ry[i] + rz[i] * rz[i]);
    weight_lanes[k] += w[i];
  };
  int i = 0;
  for (; i + kLanes <= count; i += kLanes)
    for (int k = 0; k < kLanes; ++k) add(i + k, k);
  for (int k = 0; i < count; ++i, ++k) add(i, k);
  for (int k = 0; k < kLanes; ++k) {
    squares += square_lanes[k];
    weights += weight_lanes[k];
  }
}

GELSLAM_CLONES void cauchy(const float* __restrict rx, const float* __restrict ry, const float* __restrict rz,
                           float* __restrict w, float inverse_scale2, int count) {
  for (int i = 0; i < count; ++i) {
    const float r2 = rx[i] * rx[i] + ry[i] * ry[i] + rz[i] * rz[i];
    w[i] = w[i] / (1.0f + r2 * inverse_scale2);
  }
}

/// Computes the pixel coordinates u, v at which samples appear in the target's picture, after the rotation r
/// (row-major 3x3) and the translation t (mm).
GELSLAM_CLONES void project(const float* __restrict x, const float* __restrict y, const float* __restrict z,
                            const float* __restrict r, const float* __restrict t, const TargetView& target,
                            float* __restrict u, float* __restrict v, int count) {
  const float scale = target.inverse_pitch_per_mm, center_u = target.center_u_px,
              center_v = target.center_v_px, inverse_distance = target.inverse_distance;
  const float r0 = r[0], r1 = r[1], r2 = r[2], r3 = r[3], r4 = r[4], r5 = r[5], r6 = r[6], r7 = r[7],
              r8 = r[8], t0 = t[0], t1 = t[1], t2 = t[2];
  for (int i = 0; i < count; ++i) {
    const float depth = 1.0f + (r6 * x[i] + r7 * y[i] + r8 * z[i] + t2) * inverse_distance;
    // A point behind the camera gets a pixel outside any picture.
    const float shrink = depth > 0.0f ? 1.0f / depth : 1e9f;
    u[i] = (r0 * x[i] + r1 * y[i] + r2 * z[i] + t0) * shrink * scale + center_u;
    v[i] = (r3 * x[i] + r4 * y[i] + r5 * z[i] + t1) * shrink * scale + center_v;
  }
}

/// Computes the residuals Rᵀ n' - n, where n' (`texel`) is the interpolated normal of the target and n that
/// of the sample.
GELSLAM_CLONES void rotate_and_subtract(const float* __restrict texel_x, const float* __restrict texel_y,
                                        const float* __restrict texel_z, const float* __restrict r,
                                        const float* __restrict nx, const float* __restrict ny,
                                        const float* __restrict nz, float* __restrict rx,
                                        float* __restrict ry, float* __restrict rz, int count) {
  const float r0 = r[0], r1 = r[1], r2 = r[2], r3 = r[3], r4 = r[4], r5 = r[5], r6 = r[6], r7 = r[7],
              r8 = r[8];
  for (int i = 0; i < count; ++i) {
    rx[i] = r0 * texel_x[i] + r3 * texel_y[i] + r6 * texel_z[i] - nx[i];
    ry[i] = r1 * texel_x[i] + r4 * texel_y[i] + r7 * texel_z[i] - ny[i];
    rz[i] = r2 * texel_x[i] + r5 * texel_y[i] + r8 * texel_z[i] - nz[i];
  }
}

using Lanes = float[kLanes];

struct NormalSums {
  Lanes gradient[kParameters] = {}, hessian[kHessianEntries] = {};
};

float sum_of(const Lanes& lanes) {
  float sum = 0;
  for (const float lane : lanes) sum += lane;
  return sum;
}

/// Adds the contributions of at most 64 samples, from index `first` on, to the normal equations.
GELSLAM_CLONES void add_block(const Samples& s, const Viewpoint& view, const Residuals& r, int first,
                              int count, NormalSums& sums) {
  Lanes along_x[kParameters], along_y[kParameters], jacobian[3][kParameters];
  for (int k = 0; k < count; ++k) {
    const PictureMotion motion = picture_motion(s, static_cast<std::size_t>(first + k), view);
    for (std::size_t a = 0; a < kParameters; ++a) {
      along_x[a][k] = motion.x[a];
      along_y[a][k] = motion.y[a];
    }
  }
  for (std::size_t c = 0; c < 3; ++c) {
    const float *dx = &s.gradient[c][static_cast<std::size_t>(first)],
                *dy = &s.gradient[3 + c][static_cast<std::size_t>(first)];
    for (std::size_t a = 0; a < kParameters; ++a)
      for (int k = 0; k < count; ++k) jacobian[c][a][k] = dx[k] * along_x[a][k] + dy[k] * along_y[a][k];
  }
  const float *nx = &s.nx[static_cast<std::size_t>(first)], *ny = &s.ny[static_cast<std::size_t>(first)],
              *nz = &s.nz[static_cast<std::size_t>(first)];
  for (int k = 0; k < count; ++k) {  // the rotation of the normal: n x e
    jacobian[1][0][k] += nz[k];
    jacobian[2][0][k] -= ny[k];
    jacobian[0][1][k] -= nz[k];
    jacobian[2][1][k] += nx[k];
    jacobian[0][2][k] += ny[k];
    jacobian[1][2][k] -= nx[k];
  }
  const float *rx = &r.rx[static_cast<std::size_t>(first)], *ry = &r.ry[static_cast<std::size_t>(first)],
              *rz = &r.rz[static_cast<std::size_t>(first)], *w = &r.weight[static_cast<std::size_t>(first)];
  std::size_t entry = 0;
  for (std::size_t a = 0; a < kParameters; ++a) {
    Lanes x, y, z;
    for (int k = 0; k < count; ++k) {
      x[k] = w[k] * jacobian[0][a][k];
      y[k] = w[k] * jacobian[1][a][k];
      z[k] = w[k] * jacobian[2][a][k];
      sums.gradient[a][k] += x[k] * rx[k] + y[k] * ry[k] + z[k] * rz[k];
    }
    for (std::size_t b = a; b < kParameters; ++b, ++entry)
      for (int k = 0; k < count; ++k)
        sums.hessian[entry][k] +=
            x[k] * jacobian[0][b][k] + y[k] * jacobian[1][b][k] + z[k] * jacobian[2][b][k];
  }
}

/// Loads a normal of three floats into a vector of four, whose last element is meaningless.
Float4 load_normal(const float* p) {
  Float4 v;
  std::memcpy(&v, p, sizeof v);
  return v;
}

/// Loads a normal that may be the last of the picture. It loads from one float before it, so that nothing
/// behind the picture is read.
Float4 load_right_normal(const float* p) {
  const Float4 v = load_normal(p - 1);
  return __builtin_shufflevector(v, v, 1, 2, 3, 3);
}

/// Interpolates the normals of the target bilinearly at (u, v), and returns their confidence divided by 255.
/// It is 0 unless all four pixels are in contact, because otherwise the interpolation would mix gel and
/// object.
class BilinearLookup {
 public:
  explicit BilinearLookup(const TargetView& target)
      : target_(target),
        limit_u_(static_cast<float>(target.width - 1)),
        limit_v_(static_cast<float>(target.height - 1)) {}

  float operator()(float u, float v, float& x, float& y, float& z) const {
    if (!(u >= 0.0f && v >= 0.0f && u < limit_u_ && v < limit_v_)) return 0.0f;
    const int ui = static_cast<int>(u), vi = static_cast<int>(v);
    const std::ptrdiff_t at = static_cast<std::ptrdiff_t>(vi) * target_.width + ui;
    const std::uint8_t* const known = target_.confidence + at;
    if (!(known[0] && known[1] && known[target_.width] && known[target_.width + 1])) return 0.0f;
    const float fu = u - static_cast<float>(ui), fv = v - static_cast<float>(vi);
    const float* const p = target_.normals + 3 * at;
    const float* const q = p + 3 * static_cast<std::ptrdiff_t>(target_.width);
    const Float4 top = load_normal(p) + fu * (load_normal(p + 3) - load_normal(p));
    const Float4 bottom = load_normal(q) + fu * (load_right_normal(q + 3) - load_normal(q));
    const Float4 between = top + fv * (bottom - top);
    x = between[0];
    y = between[1];
    z = between[2];
    return static_cast<float>(known[0]) * (1.0f / 255.0f);
  }

 private:
  const TargetView& target_;
  float limit_u_, limit_v_;
};

}  // namespace

void Samples::resize(std::size_t count) {
  for (auto* v : {&x, &y, &z, &nx, &ny, &nz, &weight}) v->resize(count);
  for (auto& v : gradient) v.resize(count);
}

void Residuals::resize(std::size_t count) {
  for (auto* v : {&rx, &ry, &rz, &weight}) v->resize(count);
}

void warp_residuals(const Samples& samples, const TargetView& target, const float* rotation,
                    const float* translation, Residuals& residuals) {
  const BilinearLookup look_up(target);
  float u[kLanes], v[kLanes], x[kLanes], y[kLanes], z[kLanes];
  for (int first = 0; first < samples.size(); first += kLanes) {
    const int count = std::min(kLanes, samples.size() - first);
    project(&samples.x[first], &samples.y[first], &samples.z[first], rotation, translation, target, u, v,
            count);
    for (int i = 0; i < count; ++i) {
      const float in_target = look_up(u[i], v[i], x[i], y[i], z[i]), in_reference = samples.weight[first + i];
      const bool inside = in_target > 0.0f;
      if (!inside) x[i] = y[i] = z[i] = 0.0f;
      residuals.weight[first + i] = inside ? shared_confidence(in_target, in_reference) : 0.0f;
    }
    rotate_and_subtract(x, y, z, rotation, &samples.nx[first], &samples.ny[first], &samples.nz[first],
                        &residuals.rx[first], &residuals.ry[first], &residuals.rz[first], count);
  }
}

void apply_robust_weights(Residuals& residuals, float scale) {
  cauchy(residuals.rx.data(), residuals.ry.data(), residuals.rz.data(), residuals.weight.data(),
         1.0f / (scale * scale), static_cast<int>(residuals.weight.size()));
}

ResidualSums sum_residuals(const Residuals& r) {
  ResidualSums sums;
  add_squares(r.weight.data(), r.rx.data(), r.ry.data(), r.rz.data(), static_cast<int>(r.weight.size()),
              sums.squares, sums.weight);
  return sums;
}

std::array<float, 3> shared_center_mm(const Samples& s, const Residuals& residuals) {
  const float* const w = residuals.weight.data();
  const float weight = sum_residuals(residuals).weight;
  if (!(weight > 0)) return {0, 0, 0};
  return {weighted_sum(w, s.x.data(), s.size()) / weight, weighted_sum(w, s.y.data(), s.size()) / weight,
          weighted_sum(w, s.z.data(), s.size()) / weight};
}

void accumulate_normal_equations(const Samples& samples, const Viewpoint& view, const Residuals& residuals,
                                 double* gradient, double* hessian) {
  NormalSums sums;
  for (int first = 0; first < samples.size(); first += kLanes)
    add_block(samples, view, residuals, first, std::min(kLanes, samples.size() - first), sums);
  for (std::size_t c = 0; c < kParameters; ++c) gradient[c] = sum_of(sums.gradient[c]);
  for (std::size_t c = 0; c < kHessianEntries; ++c) hessian[c] = sum_of(sums.hessian[c]);
}

}  // namespace gelslam::registration::detail
