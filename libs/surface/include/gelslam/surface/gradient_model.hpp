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

/// The sizes of a network with three hidden layers (ReLU), and the layout of its numbers: for each layer the
/// weights, row-major [out][in], then the biases. `sizes` are the numbers of inputs (5), of neurons in the
/// hidden layers, and of outputs (2).
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

/// A network of other sizes than GradientModel::kShape. It can be evaluated by FrozenNetwork, but not
/// trained. The sizes of the hidden layers are multiples of 8 up to kWidest.
struct WideNetwork {
  static constexpr int kWidest = 256;
  NetworkShape shape;
  /// If set, the outputs are the components n_x, n_y of a unit normal instead of slope angles, as in the
  /// network that GelSight distributes with its Python SDK (nnmini.pt). The slopes dh/dx, dh/dy are then n_x
  /// / n_z and n_y / n_z. This order and these signs were found on recorded presses, because the texts of the
  /// SDK do not state them clearly.
  bool gives_normals = false;
  std::vector<float> numbers;

  bool operator==(const WideNetwork&) const = default;
};

/// The gradient model: a network that maps the color and the position of a pixel, (B, G, R) / 255, u / W, v /
/// H, to two slope angles in radians, atan(dh/dx) and atan(dh/dy) (NormalFlow, §III). The same type is used
/// for the derivatives of a loss by the network's numbers, and for the moments of Adam. A new one holds
/// zeros.
struct GradientModel {
  static constexpr std::size_t kLayers = NetworkShape::kLayers;
  static constexpr NetworkShape kShape = {{5, 32, 32, 32, 2}};

  std::array<float, kShape.start(kLayers)> numbers{};
  /// The standard deviation (rad) of both angles in kSigmaColumns x kSigmaRows cells of the picture, row by
  /// row; empty if the model does not state it.
  static constexpr int kSigmaColumns = 20, kSigmaRows = 15;
  std::vector<float> sigma_rad;
  /// If present, it is used instead of `numbers`, which are zero.
  std::optional<WideNetwork> wide;
  /// A 2x2 matrix, row by row. The gradient (dh/dx, dh/dy) is this matrix times the slopes that the network
  /// reads. It corrects a model of another sensor, and is the identity otherwise.
  std::array<float, 4> slope_matrix = {1, 0, 0, 1};
  /// The optics of the sensor for which the model was trained, if they are known.
  std::optional<SensorOptics> optics;
  /// The mean color (B, G, R in gray levels) of the bare gel in training, if it is known. Each channel of a
  /// picture is scaled so that the background gets this mean, and another exposure gives the same slopes.
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

/// The number of samples that the network evaluates together. Buffers are ordered [neuron][sample].
inline constexpr int kNetworkTile = 64;
struct alignas(64) NetworkTile {
  template <int Neurons>
  using Values = std::array<float, static_cast<std::size_t>(Neurons) * kNetworkTile>;
  Values<5> input{};
  std::array<Values<32>, 3> hidden{};
  Values<2> output{};
};

/// Returns the instruction set of this processor: 4 for x86-64-v4 (AVX-512), 3 for x86-64-v3 (AVX2), else 1.
int instruction_level();

/// Computes `output` from `input`, and `hidden`, which network_backward needs. All samples are computed by
/// the same operations in the same order, so that a result does not depend on the position in the tile.
/// `level`: the instruction set; a lower one than that of this processor is useful for tests and benchmarks.
void network_forward(const GradientModel& network, NetworkTile& tile, int level = instruction_level());

/// Adds the derivatives of a loss by the network's numbers to `gradient`. `d_output`: the derivatives of the
/// loss by the outputs. network_forward() has to be called before on the same tile.
void network_backward(const GradientModel& network, const NetworkTile& tile,
                      const NetworkTile::Values<2>& d_output, GradientModel& gradient,
                      int level = instruction_level());

/// The derivatives of the two outputs by the five inputs.
struct alignas(64) NetworkJacobian {
  std::array<NetworkTile::Values<5>, 2> of_output{};
};

/// A trained network, of any size. Its outputs are always slope angles in rad, also if the network gives
/// normals.
class FrozenNetwork {
 public:
  explicit FrozenNetwork(const GradientModel& network, int level = instruction_level())
      : network_(network), level_(level) {}
  /// Computes `output` from `input`, like network_forward(). A wide network leaves `hidden` unchanged.
  void forward(NetworkTile& tile) const;
  /// Computes the derivatives of the outputs by the inputs. Has to be called after forward() on the same
  /// tile.
  void jacobian(const NetworkTile& tile, NetworkJacobian& result) const;

 private:
  GradientModel network_;
  int level_;
};

/// The optimizer Adam (Kingma and Ba 2015, algorithm 1), with the decay rates of that paper.
class Adam {
 public:
  void step(GradientModel& network, const GradientModel& gradient, double learning_rate);

 private:
  GradientModel first_moment_, second_moment_;
  int steps_ = 0;
};

/// Returns the initial weights for a training: He's initialization for layers with ReLU, and zero biases.
/// `normal()` draws from the standard normal distribution.
template <class Normal>
GradientModel initial_network(Normal&& normal) {
  GradientModel network;
  for (std::size_t layer = 0; layer < GradientModel::kLayers; ++layer)
    for (float& weight : network.weight(layer))
      weight = static_cast<float>(normal() * std::sqrt(2.0 / GradientModel::kShape.sizes[layer]));
  return network;
}

}  // namespace gelslam
