#pragma once

#include <array>
#include <cmath>
#include <cstddef>
#include <filesystem>
#include <optional>
#include <span>
#include <vector>

#include "gelslam/core/sensor_optics.hpp"

namespace gelslam {

/// Where the numbers of a network lie: five inputs, three hidden layers with ReLU, two outputs; of each layer
/// the weights, row-major [out][in], then the biases.
struct NetworkShape {
  static constexpr std::size_t kLayers = 4;
  std::array<int, kLayers + 1> sizes;

  constexpr std::size_t outputs(std::size_t layer) const {
    return static_cast<std::size_t>(sizes[layer + 1]);
  }
  constexpr std::size_t weights(std::size_t layer) const {
    return static_cast<std::size_t>(sizes[layer]) * outputs(layer);
  }
  constexpr std::size_t start(std::size_t layer) const {
    return layer == 0 ? 0 : start(layer - 1) + weights(layer - 1) + outputs(layer - 1);
  }
  bool operator==(const NetworkShape&) const = default;
};

/// A network of other sizes, which only FrozenNetwork evaluates. Hidden sizes are multiples of 8 up to
/// kWidest.
struct WideNetwork {
  static constexpr int kWidest = 256;
  NetworkShape shape;
  /// The outputs are the unit normal's n_x, n_y, as in the network that GelSight ships with its Python SDK
  /// (nnmini.pt): the gel's slopes dh/dx, dh/dy are n_x / n_z and n_y / n_z. Order and signs are measured on
  /// recorded presses: the SDK's own texts name the outputs rows and columns, and its viewer converts the
  /// colors twice.
  bool gives_normals = false;
  std::vector<float> numbers;

  bool operator==(const WideNetwork&) const = default;
};

/// The pixel-wise network of the public systems: (B,G,R)/255, u/W, v/H -> two slope angles in radians
/// (atan dh/dx, atan dh/dy). The same type holds derivatives by the network's numbers and Adam's moments. A
/// new one holds zeros.
struct GradientModel {
  static constexpr std::size_t kLayers = NetworkShape::kLayers;
  static constexpr NetworkShape kShape = {{5, 32, 32, 32, 2}};

  std::array<float, kShape.start(kLayers)> numbers{};
  /// Standard deviation (rad) of both angles, of kSigmaColumns x kSigmaRows cells of the picture, row by row;
  /// empty: not stated.
  static constexpr int kSigmaColumns = 20, kSigmaRows = 15;
  std::vector<float> sigma_rad;
  /// If present, it is used instead of `numbers`, which are zero.
  std::optional<WideNetwork> wide;
  /// dh/dx, dh/dy are this, row by row, times what the network reads: the correction of another sensor's.
  std::array<float, 4> slope_matrix = {1, 0, 0, 1};
  /// The optics of the sensor that it reads, if they are known.
  std::optional<SensorOptics> optics;
  /// The mean color (B, G, R, gray levels) of the bare gel in training, if it is known. Pictures are scaled
  /// to it channel by channel, so that another exposure gives the same slopes.
  std::optional<std::array<float, 3>> bare_gel_bgr;

  std::span<float> weight(std::size_t layer) {
    return {numbers.data() + kShape.start(layer), kShape.weights(layer)};
  }
  std::span<const float> weight(std::size_t layer) const {
    return {numbers.data() + kShape.start(layer), kShape.weights(layer)};
  }
  std::span<float> bias(std::size_t layer) {
    return {weight(layer).data() + kShape.weights(layer), kShape.outputs(layer)};
  }
  std::span<const float> bias(std::size_t layer) const {
    return {weight(layer).data() + kShape.weights(layer), kShape.outputs(layer)};
  }
  bool operator==(const GradientModel&) const = default;
};

/// Writes a PyTorch (>= 1.6) state_dict: a zip with pickle protocol 2 that torch.load reads, also with
/// weights_only. The same model gives the same bytes. Throws Error when the disk does not take it.
void write_pth_model(const std::filesystem::path& path, const GradientModel& model);

/// Samples that the network evaluates together. Buffers are [neuron][sample].
inline constexpr int kNetworkTile = 64;
struct alignas(64) NetworkTile {
  template <int Neurons>
  using Values = std::array<float, static_cast<std::size_t>(Neurons) * kNetworkTile>;
  Values<5> input{};
  std::array<Values<32>, 3> hidden{};
  Values<2> output{};
};

/// The level of this processor, numbered as the levels of x86-64: 4 has AVX-512, 3 AVX2. 1 elsewhere.
int instruction_level();

/// Computes `output` (and `hidden`, which network_backward needs) from `input`. Every sample takes the same
/// operations in the same order: its result does not depend on its place in the tile.
/// A `level` below this processor's is for tests and benchmarks.
void network_forward(const GradientModel& network, NetworkTile& tile, int level = instruction_level());

/// Adds the derivatives of a loss by the network's numbers; `d_output` holds its derivatives by the outputs.
void network_backward(const GradientModel& network, const NetworkTile& tile,
                      const NetworkTile::Values<2>& d_output, GradientModel& gradient,
                      int level = instruction_level());

/// Derivatives of both outputs by the inputs.
struct alignas(64) NetworkJacobian {
  std::array<NetworkTile::Values<5>, 2> of_output{};
};

/// A network whose numbers no longer change. A wide one gives angles, too, and leaves `hidden` as it is.
class FrozenNetwork {
 public:
  explicit FrozenNetwork(const GradientModel& network, int level = instruction_level())
      : network_(network), level_(level) {}
  /// Like network_forward().
  void forward(NetworkTile& tile) const;
  /// To be called after forward() on the same tile.
  void jacobian(const NetworkTile& tile, NetworkJacobian& result) const;

 private:
  GradientModel network_;
  int level_;
};

/// Adam (Kingma & Ba 2015, algorithm 1), with the published decay rates.
class Adam {
 public:
  void step(GradientModel& network, const GradientModel& gradient, double learning_rate);

 private:
  GradientModel first_moment_, second_moment_;
  int steps_ = 0;
};

/// First weights for training: He's initialization for ReLU layers; biases are zero. `normal()` draws from
/// the standard normal distribution.
template <class Normal>
GradientModel initial_network(Normal&& normal) {
  GradientModel network;
  for (std::size_t layer = 0; layer < GradientModel::kLayers; ++layer)
    for (float& weight : network.weight(layer))
      weight = static_cast<float>(normal() * std::sqrt(2.0 / GradientModel::kShape.sizes[layer]));
  return network;
}

}  // namespace gelslam
