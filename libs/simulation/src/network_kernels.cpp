// Plain floats, no Eigen: compiled for several instruction sets, chosen at run time.

#include "network_kernels.hpp"

#include <cmath>

#include "gelslam/core/target_clones.hpp"

#define GELSLAM_CLONES GELSLAM_TARGET_CLONES("avx512f", "avx2,fma", "default")

namespace gelslam::simulation::detail {

namespace {
constexpr int lanes = 32;
}

GELSLAM_CLONES void affine(const float* __restrict weight, const float* __restrict bias,
                           const float* __restrict in, float* __restrict out, int outputs, int inputs) {
  for (int first = 0; first < tile_samples; first += lanes)
    for (int o = 0; o < outputs; ++o) {
      float sum[lanes];
      for (int k = 0; k < lanes; ++k) sum[k] = bias != nullptr ? bias[o] : 0.0F;
      for (int i = 0; i < inputs; ++i) {
        const float w = weight[o * inputs + i];
        const float* x = in + i * tile_samples + first;
        for (int k = 0; k < lanes; ++k) sum[k] += w * x[k];
      }
      for (int k = 0; k < lanes; ++k) out[o * tile_samples + first + k] = sum[k];
    }
}

GELSLAM_CLONES void add_weight_gradient(const float* __restrict delta, const float* __restrict in,
                                        float* __restrict gradient, int outputs, int inputs) {
  for (int o = 0; o < outputs; ++o)
    for (int i = 0; i < inputs; ++i) {
      const float* d = delta + o * tile_samples;
      const float* x = in + i * tile_samples;
      float sum[lanes] = {};  // separate sums: the compiler may not reorder one
      for (int first = 0; first < tile_samples; first += lanes)
        for (int k = 0; k < lanes; ++k) sum[k] += d[first + k] * x[first + k];
      for (int width = lanes / 2; width > 0; width /= 2)
        for (int k = 0; k < width; ++k) sum[k] += sum[k + width];
      gradient[o * inputs + i] += sum[0];
    }
}

GELSLAM_CLONES void relu(float* values, int neurons) {
  for (int k = 0; k < neurons * tile_samples; ++k) values[k] = values[k] > 0.0F ? values[k] : 0.0F;
}

GELSLAM_CLONES void relu_backward(const float* __restrict output, float* __restrict delta, int neurons) {
  for (int k = 0; k < neurons * tile_samples; ++k) delta[k] = output[k] > 0.0F ? delta[k] : 0.0F;
}

GELSLAM_CLONES void adam(float* __restrict weight, const float* __restrict gradient, float* __restrict first,
                         float* __restrict second, int count, float rate, float epsilon) {
  for (int k = 0; k < count; ++k) {
    first[k] = 0.9F * first[k] + 0.1F * gradient[k];
    second[k] = 0.999F * second[k] + 0.001F * gradient[k] * gradient[k];
    weight[k] -= rate * first[k] / (std::sqrt(second[k]) + epsilon);
  }
}

}  // namespace gelslam::simulation::detail
