#include "slopes/gradient_kernel.hpp"

#include <algorithm>
#include <string>

#include "gelslam/core/error.hpp"
#include "gelslam/core/target_clones.hpp"

#define GELSLAM_KERNEL GELSLAM_TARGET_CLONES("avx512f", "fma", "default")

namespace gelslam::surface::detail {
namespace {

constexpr int tile = gradient_tile_pixels;
constexpr float max_slope_rad = 1.5F;  // keeps tan finite; a gel cannot stand steeper

// out[Outputs][tile] = weight * in[Inputs][tile] + bias, optionally rectified. Blocks of 4 outputs by 4
// inputs give 16 multiply-adds for 12 loads and stores, which keeps the arithmetic units busy.
template <int Inputs, int Outputs>
[[gnu::always_inline]] inline void hidden_layer(const float* weight, const float* bias,
                                                const float* __restrict in, float* __restrict out) {
  static_assert(Outputs % 4 == 0);
  for (int o = 0; o < Outputs; o += 4) {
    float* __restrict out0 = out + o * tile;
    float* __restrict out1 = out0 + tile;
    float* __restrict out2 = out1 + tile;
    float* __restrict out3 = out2 + tile;
    for (int p = 0; p < tile; ++p) {
      out0[p] = bias[o];
      out1[p] = bias[o + 1];
      out2[p] = bias[o + 2];
      out3[p] = bias[o + 3];
    }
    int i = 0;
    for (; i + 4 <= Inputs; i += 4) {
      const float* w0 = weight + o * Inputs + i;
      const float* w1 = w0 + Inputs;
      const float* w2 = w1 + Inputs;
      const float* w3 = w2 + Inputs;
      const float* __restrict in0 = in + i * tile;
      const float* __restrict in1 = in0 + tile;
      const float* __restrict in2 = in1 + tile;
      const float* __restrict in3 = in2 + tile;
      for (int p = 0; p < tile; ++p) {
        const float a = in0[p], b = in1[p], c = in2[p], d = in3[p];
        out0[p] += w0[0] * a + w0[1] * b + w0[2] * c + w0[3] * d;
        out1[p] += w1[0] * a + w1[1] * b + w1[2] * c + w1[3] * d;
        out2[p] += w2[0] * a + w2[1] * b + w2[2] * c + w2[3] * d;
        out3[p] += w3[0] * a + w3[1] * b + w3[2] * c + w3[3] * d;
      }
    }
    for (; i < Inputs; ++i) {
      const float* __restrict in0 = in + i * tile;
      const float w0 = weight[o * Inputs + i], w1 = weight[(o + 1) * Inputs + i];
      const float w2 = weight[(o + 2) * Inputs + i], w3 = weight[(o + 3) * Inputs + i];
      for (int p = 0; p < tile; ++p) {
        out0[p] += w0 * in0[p];
        out1[p] += w1 * in0[p];
        out2[p] += w2 * in0[p];
        out3[p] += w3 * in0[p];
      }
    }
    for (int p = 0; p < tile; ++p) {
      out0[p] = std::max(out0[p], 0.0F);
      out1[p] = std::max(out1[p], 0.0F);
      out2[p] = std::max(out2[p], 0.0F);
      out3[p] = std::max(out3[p], 0.0F);
    }
  }
}

[[gnu::always_inline]] inline void output_layer(const float* weight, float bias, const float* __restrict in,
                                                float* __restrict out) {
  for (int p = 0; p < tile; ++p) out[p] = bias;
  for (int i = 0; i < 32; ++i) {
    for (int p = 0; p < tile; ++p) out[p] += weight[i] * in[i * tile + p];
  }
}

// tan by the power series of sine and cosine: relative error below 1e-6 for |angle| <= 1.5, without branches
// or calls.
[[gnu::always_inline]] inline void tangent(float* __restrict values) {
  for (int p = 0; p < tile; ++p) {
    const float x = std::min(std::max(values[p], -max_slope_rad), max_slope_rad);
    const float s = x * x;
    const float sine =
        x *
        (1.0F + s * (-1.0F / 6 + s * (1.0F / 120 + s * (-1.0F / 5040 + s * (1.0F / 362880 - s / 39916800)))));
    const float cosine =
        1.0F +
        s * (-0.5F + s * (1.0F / 24 +
                          s * (-1.0F / 720 + s * (1.0F / 40320 + s * (-1.0F / 3628800 + s / 479001600)))));
    values[p] = sine / cosine;
  }
}

void copy_numbers(const std::vector<float>& from, float* to, std::size_t count) {
  if (from.size() != count) throw Error("gradient model: expected a 5-32-32-32-2 network");
  std::copy(from.begin(), from.end(), to);
}

}  // namespace

GradientWeights pack_weights(const GradientModel& model) {
  if (model.layers.size() != 4) {
    throw Error("gradient model: expected 4 layers, got " + std::to_string(model.layers.size()));
  }
  GradientWeights packed;
  copy_numbers(model.layers[0].weight, packed.weight1, 32 * 5);
  copy_numbers(model.layers[1].weight, packed.weight2, 32 * 32);
  copy_numbers(model.layers[2].weight, packed.weight3, 32 * 32);
  copy_numbers(model.layers[3].weight, packed.weight4, 2 * 32);
  copy_numbers(model.layers[0].bias, packed.bias1, 32);
  copy_numbers(model.layers[1].bias, packed.bias2, 32);
  copy_numbers(model.layers[2].bias, packed.bias3, 32);
  copy_numbers(model.layers[3].bias, packed.bias4, 2);
  return packed;
}

GELSLAM_KERNEL void gradient_tile(const GradientWeights& weights, const float* features, float* gx,
                                  float* gy) {
  alignas(64) float first[32 * tile];
  alignas(64) float second[32 * tile];
  hidden_layer<gradient_features, 32>(weights.weight1, weights.bias1, features, first);
  hidden_layer<32, 32>(weights.weight2, weights.bias2, first, second);
  hidden_layer<32, 32>(weights.weight3, weights.bias3, second, first);
  output_layer(weights.weight4, weights.bias4[0], first, gx);
  output_layer(weights.weight4 + 32, weights.bias4[1], first, gy);
  tangent(gx);
  tangent(gy);
}

}  // namespace gelslam::surface::detail
