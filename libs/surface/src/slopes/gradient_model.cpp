// Evaluates and trains the gradient model, a small multilayer perceptron (NormalFlow, §III). The loops over
// samples are compiled for several instruction sets, of which one is chosen at run time.

#include "gelslam/surface/gradient_model.hpp"

#include <algorithm>

#include "gelslam/core/target_clones.hpp"

namespace gelslam {
namespace {

constexpr int kTile = kNetworkTile;

// Vectors that fit into one register of the instruction set. GCC keeps longer ones in memory, which is ten
// times slower.
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
  // The number of sums that are accumulated at the same time: half of the 32 registers of AVX-512, or of the
  // 16 of other instruction sets. Several independent sums hide the latency of multiply-add, and each input
  // and weight that is loaded is used several times.
  static constexpr int kSums = kLanes == 16 ? 16 : 8;
  static constexpr int kBlock = kSums / 2;  // the number of a hidden layer's outputs computed at a time

  // Computes out[o][p] = sum_i weight(o, i) in[i][p] + bias[o], with weight(o, i) = weight[o * out_stride + i
  // * in_stride], for all samples p of a tile. `outputs` is a multiple of `Block`. If `Rectify` is set, a
  // ReLU is applied to the result.
  template <int Block, bool Rectify>
  [[gnu::always_inline]] static void multiply(int outputs, int inputs, int out_stride, int in_stride,
                                              const float* weight, const float* bias, const float* in,
                                              float* out) {
    constexpr int columns = std::min(kSums / Block, kTile / kLanes);
    for (int o = 0; o < outputs; o += Block)
      for (int p = 0; p < kTile; p += columns * kLanes) {
        Vector sum[Block][columns];
        for (int k = 0; k < Block; ++k)
          for (int c = 0; c < columns; ++c) sum[k][c] = Vector{} + (bias != nullptr ? bias[o + k] : 0.0F);
        for (int i = 0; i < inputs; ++i) {
          const Vector* const x = reinterpret_cast<const Vector*>(in + i * kTile + p);
          for (int k = 0; k < Block; ++k)
            for (int c = 0; c < columns; ++c)
              sum[k][c] += weight[(o + k) * out_stride + i * in_stride] * x[c];
        }
        for (int k = 0; k < Block; ++k)
          for (int c = 0; c < columns; ++c)
            reinterpret_cast<Vector*>(out + (o + k) * kTile + p)[c] =
                Rectify ? (sum[k][c] > 0.0F ? sum[k][c] : Vector{}) : sum[k][c];
      }
  }

  template <int Block, bool Rectify>
  [[gnu::always_inline]] static void run_layer(const NetworkShape& shape, const float* numbers,
                                               std::size_t layer, const float* in, float* out) {
    const float* const weight = numbers + shape.start(layer);
    const int inputs = shape.sizes[layer];
    multiply<Block, Rectify>(shape.sizes[layer + 1], inputs, inputs, 1, weight, weight + shape.weights(layer),
                             in, out);
  }

  /// Propagates derivatives back through a layer: from `delta`, those by its outputs, to those by its inputs.
  template <int Block>
  [[gnu::always_inline]] static void run_back(const NetworkShape& shape, const float* numbers,
                                              std::size_t layer, const float* delta, float* out) {
    const int inputs = shape.sizes[layer];
    multiply<Block, false>(inputs, shape.sizes[layer + 1], 1, inputs, numbers + shape.start(layer), nullptr,
                           delta, out);
  }

  // Adds the derivatives by a layer's weights: gradient[o][i] += sum_p delta[o][p] in[i][p].
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

  [[gnu::always_inline]] static void rectify_derivative(int neurons, const float* output, float* delta) {
    for (int k = 0; k < neurons * kTile; ++k) delta[k] = output[k] > 0.0F ? delta[k] : 0.0F;
  }

  template <class Tile>
  [[gnu::always_inline]] static void forward(const NetworkShape& shape, const float* numbers, Tile& t) {
    run_layer<kBlock, true>(shape, numbers, 0, t.input.data(), t.hidden[0].data());
    run_layer<kBlock, true>(shape, numbers, 1, t.hidden[0].data(), t.hidden[1].data());
    run_layer<kBlock, true>(shape, numbers, 2, t.hidden[1].data(), t.hidden[2].data());
    run_layer<2, false>(shape, numbers, 3, t.hidden[2].data(), t.output.data());
  }

  template <class Tile>
  [[gnu::always_inline]] static void jacobian(const NetworkShape& shape, const float* numbers, const Tile& t,
                                              NetworkJacobian& result) {
    alignas(64) float upper[sizeof t.hidden[0] / sizeof(float)];
    alignas(64) float lower[sizeof t.hidden[0] / sizeof(float)];
    const int last = shape.sizes[3];
    for (int o = 0; o < 2; ++o) {
      const float* const weight = numbers + shape.start(3) + o * last;
      for (int k = 0; k < last; ++k)
        for (int p = 0; p < kTile; ++p) upper[k * kTile + p] = weight[k];
      rectify_derivative(last, t.hidden[2].data(), upper);
      run_back<kBlock>(shape, numbers, 2, upper, lower);
      rectify_derivative(shape.sizes[2], t.hidden[1].data(), lower);
      run_back<kBlock>(shape, numbers, 1, lower, upper);
      rectify_derivative(shape.sizes[1], t.hidden[0].data(), upper);
      run_back<1>(shape, numbers, 0, upper, result.of_output[static_cast<std::size_t>(o)].data());
    }
  }

  [[gnu::always_inline]] static void backward(const GradientModel& n, const NetworkTile& t,
                                              const NetworkTile::Values<2>& d_output, GradientModel& g) {
    alignas(64) float upper[32 * kTile];
    alignas(64) float lower[32 * kTile];
    alignas(64) float output[2 * kTile];
    const float* const numbers = n.numbers.data();
    for (int k = 0; k < 2 * kTile; ++k) output[k] = d_output[static_cast<std::size_t>(k)];
    add_products<2, 32>(output, t.hidden[2].data(), g.weight(3).data());
    add_sums<2>(output, g.bias(3).data());
    run_back<kBlock>(n.kShape, numbers, 3, output, upper);
    rectify_derivative(32, t.hidden[2].data(), upper);
    add_products<32, 32>(upper, t.hidden[1].data(), g.weight(2).data());
    add_sums<32>(upper, g.bias(2).data());
    run_back<kBlock>(n.kShape, numbers, 2, upper, lower);
    rectify_derivative(32, t.hidden[1].data(), lower);
    add_products<32, 32>(lower, t.hidden[0].data(), g.weight(1).data());
    add_sums<32>(lower, g.bias(1).data());
    run_back<kBlock>(n.kShape, numbers, 1, lower, upper);
    rectify_derivative(32, t.hidden[0].data(), upper);
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

/// The values of a wide network for a tile of samples. It is not initialized, because most networks use only
/// a part of it.
struct alignas(64) WideTile {
  NetworkTile::Values<5> input;
  std::array<NetworkTile::Values<WideNetwork::kWidest>, 3> hidden;
  NetworkTile::Values<2> output;
};

void run_wide(const WideNetwork& network, const NetworkTile& tile, int level, WideTile& wide) {
  wide.input = tile.input;
  run(level, [&] [[gnu::always_inline]] (auto kernels) {
    kernels.forward(network.shape, network.numbers.data(), wide);
  });
}

// A unit normal. Where the network's outputs for x and y are too long for a unit vector, z is limited so that
// the slope is at most 1.5 rad.
struct Normal {
  float x, y, z;
};

Normal normal_of(const WideTile& tile, std::size_t sample) {
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
  run(level, [&] [[gnu::always_inline]] (auto kernels) { kernels.forward(n.kShape, n.numbers.data(), t); });
}

void FrozenNetwork::forward(NetworkTile& tile) const {
  if (!network_.wide) return network_forward(network_, tile, level_);
  WideTile wide;
  run_wide(*network_.wide, tile, level_, wide);
  tile.output = wide.output;
  if (!network_.wide->gives_normals) return;
  for (std::size_t p = 0; p < kTile; ++p) {
    const Normal n = normal_of(wide, p);
    tile.output[p] = std::atan(n.x / n.z);
    tile.output[kTile + p] = std::atan(n.y / n.z);
  }
}

void FrozenNetwork::jacobian(const NetworkTile& tile, NetworkJacobian& result) const {
  const auto of = [&](const NetworkShape& shape, const auto& numbers, const auto& evaluated) {
    run(level_, [&] [[gnu::always_inline]] (auto kernels) {
      kernels.jacobian(shape, numbers.data(), evaluated, result);
    });
  };
  if (!network_.wide) return of(GradientModel::kShape, network_.numbers, tile);
  WideTile wide;
  run_wide(*network_.wide, tile, level_, wide);
  of(network_.wide->shape, network_.wide->numbers, wide);
  if (!network_.wide->gives_normals) return;
  // d atan(x/z) = ((x² + z²) dx + x y dy) / (z (x² + z²)), and with x and y exchanged.
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
  // Adam's bias corrections are combined with the learning rate and epsilon.
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
