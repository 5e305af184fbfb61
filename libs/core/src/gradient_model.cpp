// Plain floats: compiled for several instruction sets, chosen at run time.

#include "gelslam/core/gradient_model.hpp"

#include <algorithm>
#include <cmath>

#include "gelslam/core/target_clones.hpp"

namespace gelslam {
namespace {

constexpr int kTile = kNetworkTile;

// Vectors of one register: GCC keeps longer ones in memory, which takes ten times as long.
struct Register128 {
  typedef float Vector __attribute__((vector_size(16), may_alias));
};
struct Register256 {
  typedef float Vector __attribute__((vector_size(32), may_alias));
};
struct Register512 {
  typedef float Vector __attribute__((vector_size(64), may_alias));
};

template <class Register>
struct Kernels {
  using Vector = typename Register::Vector;
  static constexpr int kLanes = sizeof(Vector) / sizeof(float);
  // Sums at once, of the 32 registers of AVX-512 or the 16 of others: they hide the latency of multiply-add,
  // and each input and weight that is loaded serves several.
  static constexpr int kSums = kLanes == 16 ? 16 : 8;

  // out[o][p] = sum_i weight(o, i) in[i][p] + bias[o]; weight(o, i) = weight[o * OutStride + i * InStride].
  template <int Outputs, int Inputs, int OutStride, int InStride, bool Rectify>
  [[gnu::always_inline]] static void multiply(const float* weight, const float* bias, const float* in,
                                              float* out) {
    constexpr int block = Outputs % 8 == 0 ? kSums / 2 : Outputs % 2 == 0 ? 2 : 1;
    constexpr int columns = std::min(kSums / block, kTile / kLanes);
    for (int o = 0; o < Outputs; o += block)
      for (int p = 0; p < kTile; p += columns * kLanes) {
        Vector sum[block][columns];
        for (int k = 0; k < block; ++k)
          for (int c = 0; c < columns; ++c) sum[k][c] = Vector{} + (bias != nullptr ? bias[o + k] : 0.0F);
        for (int i = 0; i < Inputs; ++i) {
          const Vector* const x = reinterpret_cast<const Vector*>(in + i * kTile + p);
          for (int k = 0; k < block; ++k)
            for (int c = 0; c < columns; ++c) sum[k][c] += weight[(o + k) * OutStride + i * InStride] * x[c];
        }
        for (int k = 0; k < block; ++k)
          for (int c = 0; c < columns; ++c)
            reinterpret_cast<Vector*>(out + (o + k) * kTile + p)[c] =
                Rectify ? (sum[k][c] > 0.0F ? sum[k][c] : Vector{}) : sum[k][c];
      }
  }

  // gradient[o][i] += sum_p delta[o][p] in[i][p]
  template <int Outputs, int Inputs>
  [[gnu::always_inline]] static void add_products(const float* delta, const float* in, float* gradient) {
    constexpr int block = 2;
    for (int o = 0; o < Outputs; o += block)
      for (int i = 0; i < Inputs; ++i) {
        Vector sum[block] = {};
        for (int p = 0; p < kTile; p += kLanes) {
          const Vector x = *reinterpret_cast<const Vector*>(in + i * kTile + p);
          for (int k = 0; k < block; ++k)
            sum[k] += x * *reinterpret_cast<const Vector*>(delta + (o + k) * kTile + p);
        }
        for (int k = 0; k < block; ++k) {
          float total = 0.0F;
          for (int lane = 0; lane < kLanes; ++lane) total += sum[k][lane];
          gradient[(o + k) * Inputs + i] += total;
        }
      }
  }

  template <int Neurons>
  [[gnu::always_inline]] static void add_sums(const float* delta, float* gradient) {
    for (int n = 0; n < Neurons; ++n) {
      Vector sum{};
      for (int p = 0; p < kTile; p += kLanes) sum += *reinterpret_cast<const Vector*>(delta + n * kTile + p);
      for (int lane = 0; lane < kLanes; ++lane) gradient[n] += sum[lane];
    }
  }

  template <int Neurons>
  [[gnu::always_inline]] static void rectify_derivative(const float* output, float* delta) {
    for (int k = 0; k < Neurons * kTile; ++k) delta[k] = output[k] > 0.0F ? delta[k] : 0.0F;
  }

  template <int H>
  [[gnu::always_inline]] static void forward(const PixelNetwork<H>& n, PixelNetworkTile<H>& t) {
    multiply<H, 5, 5, 1, true>(n.weight(0).data(), n.bias(0).data(), t.input.data(), t.hidden[0].data());
    multiply<H, H, H, 1, true>(n.weight(1).data(), n.bias(1).data(), t.hidden[0].data(), t.hidden[1].data());
    multiply<H, H, H, 1, true>(n.weight(2).data(), n.bias(2).data(), t.hidden[1].data(), t.hidden[2].data());
    multiply<2, H, H, 1, false>(n.weight(3).data(), n.bias(3).data(), t.hidden[2].data(), t.output.data());
  }

  template <int H>
  [[gnu::always_inline]] static void jacobian(const PixelNetwork<H>& n, const PixelNetworkTile<H>& t,
                                              NetworkJacobian& result) {
    alignas(64) float upper[H * kTile];
    alignas(64) float lower[H * kTile];
    for (std::size_t o = 0; o < 2; ++o) {
      for (std::size_t k = 0; k < H; ++k)
        for (int p = 0; p < kTile; ++p) upper[static_cast<int>(k) * kTile + p] = n.weight(3)[o * H + k];
      rectify_derivative<H>(t.hidden[2].data(), upper);
      multiply<H, H, 1, H, false>(n.weight(2).data(), nullptr, upper, lower);
      rectify_derivative<H>(t.hidden[1].data(), lower);
      multiply<H, H, 1, H, false>(n.weight(1).data(), nullptr, lower, upper);
      rectify_derivative<H>(t.hidden[0].data(), upper);
      multiply<5, H, 1, 5, false>(n.weight(0).data(), nullptr, upper, result.of_output[o].data());
    }
  }

  [[gnu::always_inline]] static void backward(const GradientModel& n, const NetworkTile& t,
                                              const NetworkTile::Values<2>& d_output, GradientModel& g) {
    alignas(64) float upper[32 * kTile];
    alignas(64) float lower[32 * kTile];
    alignas(64) float output[2 * kTile];
    for (int k = 0; k < 2 * kTile; ++k) output[k] = d_output[static_cast<std::size_t>(k)];
    add_products<2, 32>(output, t.hidden[2].data(), g.weight(3).data());
    add_sums<2>(output, g.bias(3).data());
    multiply<32, 2, 1, 32, false>(n.weight(3).data(), nullptr, output, upper);
    rectify_derivative<32>(t.hidden[2].data(), upper);
    add_products<32, 32>(upper, t.hidden[1].data(), g.weight(2).data());
    add_sums<32>(upper, g.bias(2).data());
    multiply<32, 32, 1, 32, false>(n.weight(2).data(), nullptr, upper, lower);
    rectify_derivative<32>(t.hidden[1].data(), lower);
    add_products<32, 32>(lower, t.hidden[0].data(), g.weight(1).data());
    add_sums<32>(lower, g.bias(1).data());
    multiply<32, 32, 1, 32, false>(n.weight(1).data(), nullptr, lower, upper);
    rectify_derivative<32>(t.hidden[0].data(), upper);
    add_products<32, 5>(upper, t.input.data(), g.weight(0).data());
    add_sums<32>(upper, g.bias(0).data());
  }
};

template <class Function>
GELSLAM_TARGET("arch=x86-64-v4")
void run_v4(const Function& function) {
  function(Kernels<Register512>{});
}

template <class Function>
GELSLAM_TARGET("arch=x86-64-v3")
void run_v3(const Function& function) {
  function(Kernels<Register256>{});
}

template <class Function>
void run(int level, const Function& function) {
  if (level >= 4)
    run_v4(function);
  else if (level == 3)
    run_v3(function);
  else
    function(Kernels<Register128>{});
}

using MakerTile = PixelNetworkTile<64>;

MakerTile run_maker(const MakerNetwork& network, const NetworkTile& tile, int level) {
  MakerTile wide;
  wide.input = tile.input;
  run(level, [&] [[gnu::always_inline]] (auto kernels) { kernels.forward(network, wide); });
  return wide;
}

// Two components of a normal and the third. What is no part of a unit normal is nearly upright: 1.5 rad.
struct Normal {
  float x, y, z;
};

Normal normal_of(const MakerTile& tile, std::size_t sample) {
  const float x = tile.output[sample], y = tile.output[kTile + sample];
  return {x, y, std::sqrt(std::max(0.005F, 1.0F - x * x - y * y))};
}

}  // namespace

int instruction_level() {
#if GELSLAM_HAS_TARGETS
  if (__builtin_cpu_supports("x86-64-v4")) return 4;
  if (__builtin_cpu_supports("x86-64-v3")) return 3;
#endif
  return 1;
}

void network_forward(const GradientModel& n, NetworkTile& t, int level) {
  run(level, [&] [[gnu::always_inline]] (auto kernels) { kernels.forward(n, t); });
}

void FrozenNetwork::forward(NetworkTile& tile) const {
  if (network_.maker) {
    const MakerTile wide = run_maker(*network_.maker, tile, level_);
    for (std::size_t p = 0; p < kTile; ++p) {
      const Normal n = normal_of(wide, p);
      tile.output[p] = std::atan(n.x / n.z);
      tile.output[kTile + p] = std::atan(n.y / n.z);
    }
    return;
  }
  network_forward(network_, tile, level_);
}

void FrozenNetwork::jacobian(const NetworkTile& tile, NetworkJacobian& result) const {
  if (network_.maker) return maker_jacobian(tile, result);
  run(level_, [&] [[gnu::always_inline]] (auto kernels) { kernels.jacobian(network_, tile, result); });
}

// d atan(x/z) = ((x² + z²) dx + x y dy) / (z (x² + z²)), and with x and y exchanged.
void FrozenNetwork::maker_jacobian(const NetworkTile& tile, NetworkJacobian& result) const {
  const MakerTile wide = run_maker(*network_.maker, tile, level_);
  run(level_, [&] [[gnu::always_inline]] (auto kernels) { kernels.jacobian(*network_.maker, wide, result); });
  for (std::size_t p = 0; p < kTile; ++p) {
    const Normal n = normal_of(wide, p);
    const float cross_x = n.x * n.y / (n.x * n.x + n.z * n.z), cross_y = n.x * n.y / (n.y * n.y + n.z * n.z);
    for (std::size_t at = p; at < result.of_output[0].size(); at += kTile) {
      float &dx = result.of_output[0][at], &dy = result.of_output[1][at];
      const float angle_x = (dx + cross_x * dy) / n.z, angle_y = (dy + cross_y * dx) / n.z;
      dx = angle_x;
      dy = angle_y;
    }
  }
}

void network_backward(const GradientModel& n, const NetworkTile& t, const NetworkTile::Values<2>& d_output,
                      GradientModel& g, int level) {
  run(level, [&] [[gnu::always_inline]] (auto kernels) { kernels.backward(n, t, d_output, g); });
}

GELSLAM_CLONES void Adam::step(GradientModel& network, const GradientModel& gradient, double learning_rate) {
  ++steps_;
  // The published bias corrections, folded into rate and epsilon.
  const double second = std::sqrt(1.0 - std::pow(0.999, steps_)), first = 1.0 - std::pow(0.9, steps_);
  const auto rate = static_cast<float>(learning_rate * second / first),
             epsilon = static_cast<float>(1e-8 * second);
  float* const weight = network.numbers.data();
  const float* const slope = gradient.numbers.data();
  float* const mean = first_moment_.numbers.data();
  float* const square = second_moment_.numbers.data();
  for (std::size_t k = 0; k < network.numbers.size(); ++k) {
    mean[k] = 0.9F * mean[k] + 0.1F * slope[k];
    square[k] = 0.999F * square[k] + 0.001F * slope[k] * slope[k];
    weight[k] -= rate * mean[k] / (std::sqrt(square[k]) + epsilon);
  }
}

}  // namespace gelslam
