#include "normal_flow_kernels.hpp"

#include <cmath>
#include <cstdint>
#include <cstring>

#include "gelslam/core/target_clones.hpp"

namespace gelslam::registration::detail {
namespace {

using Float4 = float __attribute__((vector_size(16)));

Float4 load4(const float* p) {
  Float4 v;
  std::memcpy(&v, p, sizeof v);
  return v;
}

#define GELSLAM_CLONES GELSLAM_TARGET_CLONES("avx512f", "arch=haswell", "default")

// Sums in 64 independent lanes: the order of additions, and so the result, does not depend on the vector width.
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

GELSLAM_CLONES float projected_sum(const float* __restrict wx, const float* __restrict wy, const float* __restrict wz,
                                   const float* __restrict jx, const float* __restrict jy, const float* __restrict jz,
                                   int count) {
  float lanes[kLanes] = {};
  int i = 0;
  for (; i + kLanes <= count; i += kLanes)
    for (int k = 0; k < kLanes; ++k)
      lanes[k] += wx[i + k] * jx[i + k] + wy[i + k] * jy[i + k] + wz[i + k] * jz[i + k];
  for (int k = 0; i < count; ++i, ++k) lanes[k] += wx[i] * jx[i] + wy[i] * jy[i] + wz[i] * jz[i];
  float sum = 0;
  for (int k = 0; k < kLanes; ++k) sum += lanes[k];
  return sum;
}

GELSLAM_CLONES void multiply(const float* __restrict w, const float* __restrict a, float* __restrict out, int count) {
  for (int i = 0; i < count; ++i) out[i] = w[i] * a[i];
}

GELSLAM_CLONES void cauchy(const float* __restrict rx, const float* __restrict ry, const float* __restrict rz,
                           float* __restrict w, float inverse_scale2, int count) {
  for (int i = 0; i < count; ++i) {
    const float r2 = rx[i] * rx[i] + ry[i] * ry[i] + rz[i] * rz[i];
    w[i] = w[i] / (1.0f + r2 * inverse_scale2);
  }
}

}  // namespace

void Samples::resize(std::size_t count) {
  for (auto* v : {&x, &y, &z, &nx, &ny, &nz, &weight}) v->resize(count);
  for (auto& v : jacobian) v.resize(count);
  for (auto& v : hessian) v.resize(count);
}

void Residuals::resize(std::size_t count) {
  for (auto* v : {&rx, &ry, &rz, &weight}) v->resize(count);
}

void warp_residuals(const Samples& samples, const PackedTarget& target, const float* rotation, const float* translation,
                    Residuals& residuals) {
  const float* const r = rotation;
  const int count = samples.size();
  const float limit_u = static_cast<float>(target.width - 1);
  const float limit_v = static_cast<float>(target.height - 1);
  const std::ptrdiff_t row = static_cast<std::ptrdiff_t>(target.width) * 4;
  for (int i = 0; i < count; ++i) {
    const auto k = static_cast<std::size_t>(i);
    const float x = samples.x[k], y = samples.y[k], z = samples.z[k];
    const float u = (r[0] * x + r[1] * y + r[2] * z + translation[0]) * target.inverse_pitch_per_mm + target.center_u_px;
    const float v = (r[3] * x + r[4] * y + r[5] * z + translation[1]) * target.inverse_pitch_per_mm + target.center_v_px;
    if (!(u >= 0.0f && v >= 0.0f && u < limit_u && v < limit_v)) {
      residuals.rx[k] = residuals.ry[k] = residuals.rz[k] = residuals.weight[k] = 0.0f;
      continue;
    }
    const int ui = static_cast<int>(u), vi = static_cast<int>(v);
    const float fu = u - static_cast<float>(ui), fv = v - static_cast<float>(vi);
    const float* p = target.texel.data() + vi * row + ui * 4;
    const Float4 top = load4(p) + fu * (load4(p + 4) - load4(p));
    const Float4 bottom = load4(p + row) + fu * (load4(p + row + 4) - load4(p + row));
    const Float4 texel = top + fv * (bottom - top);
    const float tx = texel[0], ty = texel[1], tz = texel[2];
    residuals.rx[k] = r[0] * tx + r[3] * ty + r[6] * tz - samples.nx[k];
    residuals.ry[k] = r[1] * tx + r[4] * ty + r[7] * tz - samples.ny[k];
    residuals.rz[k] = r[2] * tx + r[5] * ty + r[8] * tz - samples.nz[k];
    // A look-up that touches any pixel outside the contact mixes gel and object: leave it out.
    residuals.weight[k] = texel[3] > 0.999f ? samples.weight[k] : 0.0f;
  }
}

void apply_robust_weights(Residuals& residuals, float scale) {
  cauchy(residuals.rx.data(), residuals.ry.data(), residuals.rz.data(), residuals.weight.data(), 1.0f / (scale * scale),
         static_cast<int>(residuals.weight.size()));
}

void accumulate_normal_equations(const Samples& samples, const Residuals& residuals, double* gradient, double* hessian) {
  const int count = samples.size();
  thread_local std::vector<float> wx, wy, wz;
  for (auto* v : {&wx, &wy, &wz}) v->resize(static_cast<std::size_t>(count));
  multiply(residuals.weight.data(), residuals.rx.data(), wx.data(), count);
  multiply(residuals.weight.data(), residuals.ry.data(), wy.data(), count);
  multiply(residuals.weight.data(), residuals.rz.data(), wz.data(), count);
  for (std::size_t c = 0; c < kParameters; ++c)
    gradient[c] = projected_sum(wx.data(), wy.data(), wz.data(), samples.jacobian[c].data(),
                                samples.jacobian[kParameters + c].data(), samples.jacobian[2 * kParameters + c].data(), count);
  for (std::size_t c = 0; c < kHessianEntries; ++c)
    hessian[c] = weighted_sum(residuals.weight.data(), samples.hessian[c].data(), count);
}

}  // namespace gelslam::registration::detail
