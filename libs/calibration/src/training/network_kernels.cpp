// Plain floats: compiled for several instruction sets, chosen at run time.

#include "training/network_kernels.hpp"

#include <cmath>

#include "gelslam/core/target_clones.hpp"

#define GELSLAM_CALIBRATION_KERNEL GELSLAM_TARGET_CLONES("avx512f", "fma", "default")

namespace gelslam::calibration::detail {
namespace {

constexpr int tile = tile_samples;

// Eight floats at once; the compiler splits or joins them for the instruction set.
typedef float Lanes __attribute__((vector_size(32), aligned(32), may_alias));
constexpr int lanes = 8;

// out[o][p] = sum_i weight(o, i) in[i][p] + bias[o]; weight(o, i) = weight[o * OutStride + i * InStride].
template <int Outputs, int Inputs, int OutStride, int InStride>
[[gnu::always_inline]] inline void multiply(const float* weight, const float* bias, const float* in,
                                            float* out) {
  constexpr int block = Outputs % 4 == 0 ? 4 : 1;
  for (int o = 0; o < Outputs; o += block)
    for (int p = 0; p < tile; p += 2 * lanes) {
      Lanes sum[block][2];
      for (int k = 0; k < block; ++k) {
        const float start = bias != nullptr ? bias[o + k] : 0.0F;
        sum[k][0] = sum[k][1] = Lanes{} + start;
      }
      for (int i = 0; i < Inputs; ++i) {
        const Lanes a = *reinterpret_cast<const Lanes*>(in + i * tile + p),
                    b = *reinterpret_cast<const Lanes*>(in + i * tile + p + lanes);
        for (int k = 0; k < block; ++k) {
          const float w = weight[(o + k) * OutStride + i * InStride];
          sum[k][0] += w * a;
          sum[k][1] += w * b;
        }
      }
      for (int k = 0; k < block; ++k) {
        *reinterpret_cast<Lanes*>(out + (o + k) * tile + p) = sum[k][0];
        *reinterpret_cast<Lanes*>(out + (o + k) * tile + p + lanes) = sum[k][1];
      }
    }
}

// gradient[o][i] += sum_p delta[o][p] in[i][p]
template <int Outputs, int Inputs>
[[gnu::always_inline]] inline void add_products(const float* delta, const float* in, float* gradient) {
  constexpr int block = 2;
  for (int o = 0; o < Outputs; o += block)
    for (int i = 0; i < Inputs; ++i) {
      Lanes sum[block] = {};
      for (int p = 0; p < tile; p += lanes) {
        const Lanes x = *reinterpret_cast<const Lanes*>(in + i * tile + p);
        for (int k = 0; k < block; ++k)
          sum[k] += x * *reinterpret_cast<const Lanes*>(delta + (o + k) * tile + p);
      }
      for (int k = 0; k < block; ++k) {
        float total = 0.0F;
        for (int lane = 0; lane < lanes; ++lane) total += sum[k][lane];
        gradient[(o + k) * Inputs + i] += total;
      }
    }
}

template <int Neurons>
[[gnu::always_inline]] inline void add_sums(const float* delta, float* gradient) {
  for (int n = 0; n < Neurons; ++n) {
    Lanes sum{};
    for (int p = 0; p < tile; p += lanes) sum += *reinterpret_cast<const Lanes*>(delta + n * tile + p);
    for (int lane = 0; lane < lanes; ++lane) gradient[n] += sum[lane];
  }
}

[[gnu::always_inline]] inline void rectify(float* values) {
  for (int k = 0; k < 32 * tile; ++k) values[k] = values[k] > 0.0F ? values[k] : 0.0F;
}

[[gnu::always_inline]] inline void rectify_derivative(const float* output, float* delta) {
  for (int k = 0; k < 32 * tile; ++k) delta[k] = output[k] > 0.0F ? delta[k] : 0.0F;
}

}  // namespace

GELSLAM_CALIBRATION_KERNEL void network_forward(const NetworkNumbers& n, TileActivations& t) {
  multiply<32, 5, 5, 1>(n.weight(0), n.bias(0), t.input.data(), t.hidden1.data());
  rectify(t.hidden1.data());
  multiply<32, 32, 32, 1>(n.weight(1), n.bias(1), t.hidden1.data(), t.hidden2.data());
  rectify(t.hidden2.data());
  multiply<32, 32, 32, 1>(n.weight(2), n.bias(2), t.hidden2.data(), t.hidden3.data());
  rectify(t.hidden3.data());
  multiply<2, 32, 32, 1>(n.weight(3), n.bias(3), t.hidden3.data(), t.output.data());
}

GELSLAM_CALIBRATION_KERNEL void network_backward(const NetworkNumbers& n, const TileActivations& t,
                                                 const std::array<float, 2 * tile_samples>& d_output,
                                                 NetworkNumbers& g) {
  alignas(64) float upper[32 * tile];
  alignas(64) float lower[32 * tile];
  alignas(64) float output[2 * tile];
  for (int k = 0; k < 2 * tile; ++k) output[k] = d_output[static_cast<std::size_t>(k)];
  add_products<2, 32>(output, t.hidden3.data(), g.weight(3));
  add_sums<2>(output, g.bias(3));
  multiply<32, 2, 1, 32>(n.weight(3), nullptr, output, upper);
  rectify_derivative(t.hidden3.data(), upper);
  add_products<32, 32>(upper, t.hidden2.data(), g.weight(2));
  add_sums<32>(upper, g.bias(2));
  multiply<32, 32, 1, 32>(n.weight(2), nullptr, upper, lower);
  rectify_derivative(t.hidden2.data(), lower);
  add_products<32, 32>(lower, t.hidden1.data(), g.weight(1));
  add_sums<32>(lower, g.bias(1));
  multiply<32, 32, 1, 32>(n.weight(1), nullptr, lower, upper);
  rectify_derivative(t.hidden1.data(), upper);
  add_products<32, 5>(upper, t.input.data(), g.weight(0));
  add_sums<32>(upper, g.bias(0));
}

GELSLAM_CALIBRATION_KERNEL void adam_step(NetworkNumbers& network, const NetworkNumbers& gradient,
                                          NetworkNumbers& first, NetworkNumbers& second, float rate,
                                          float epsilon) {
  float* const weight = network.values.data();
  const float* const slope = gradient.values.data();
  float* const mean = first.values.data();
  float* const square = second.values.data();
  for (int k = 0; k < NetworkNumbers::count; ++k) {
    mean[k] = 0.9F * mean[k] + 0.1F * slope[k];
    square[k] = 0.999F * square[k] + 0.001F * slope[k] * slope[k];
    weight[k] -= rate * mean[k] / (std::sqrt(square[k]) + epsilon);
  }
}

}  // namespace gelslam::calibration::detail
