#pragma once

#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <span>
#include <tuple>
#include <vector>

#include "gelslam/core/sensor_optics.hpp"

namespace gelslam {

/// Error that a slope along one axis causes in the slope along the other, as a share of the error that it
/// causes in the slope along its own axis.
inline constexpr double kCrossAxisShare = 0.3;

/// Five inputs, three hidden layers of as many neurons each with ReLU, two outputs. A new one holds zeros.
template <int Hidden>
struct PixelNetwork {
  static constexpr std::size_t kLayers = 4;
  static constexpr std::array<int, kLayers + 1> kSizes = {5, Hidden, Hidden, Hidden, 2};

  static constexpr std::size_t outputs(std::size_t layer) {
    return static_cast<std::size_t>(kSizes[layer + 1]);
  }
  static constexpr std::size_t weights(std::size_t layer) {
    return static_cast<std::size_t>(kSizes[layer]) * outputs(layer);
  }
  /// Where a layer's weights start; its biases follow them.
  static constexpr std::size_t start(std::size_t layer) {
    return layer == 0 ? 0 : start(layer - 1) + weights(layer - 1) + outputs(layer - 1);
  }

  std::array<float, 2 * Hidden * Hidden + 10 * Hidden + 2> numbers{};

  std::span<float> weight(std::size_t layer) { return {numbers.data() + start(layer), weights(layer)}; }
  std::span<const float> weight(std::size_t layer) const {  ///< row-major [out][in]
    return {numbers.data() + start(layer), weights(layer)};
  }
  std::span<float> bias(std::size_t layer) {
    return {numbers.data() + start(layer) + weights(layer), outputs(layer)};
  }
  std::span<const float> bias(std::size_t layer) const {
    return {numbers.data() + start(layer) + weights(layer), outputs(layer)};
  }
  bool operator==(const PixelNetwork&) const = default;
};

/// The network that GelSight ships with its Python SDK (nnmini.pt): (B,G,R)/255 and two zeros -> the unit
/// normal's n_x, n_y; the gel's slopes dh/dx, dh/dy are n_x / n_z and n_y / n_z. Order and signs are measured
/// on recorded presses: the SDK's own texts name the outputs rows and columns, and its viewer converts the
/// colors twice. Its positions are divided as integers, so that the network sees zeros.
using MakerNetwork = PixelNetwork<64>;

/// The pixel-wise network of the public systems: (B,G,R)/255, u/W, v/H -> two slope angles in radians
/// (atan dh/dx, atan dh/dy). The same type holds derivatives by the network's numbers and Adam's moments.
struct GradientModel : PixelNetwork<32> {
  /// Standard deviation (rad) of both angles, of kSigmaColumns x kSigmaRows cells of the picture, row by row;
  /// empty: not stated.
  static constexpr int kSigmaColumns = 20, kSigmaRows = 15;
  std::vector<float> sigma_rad;
  /// If present, it is used instead of `numbers`, which are zero. Only FrozenNetwork evaluates it.
  std::optional<MakerNetwork> maker;
  /// Of the sensor that it reads, if it is said.
  std::optional<SensorOptics> optics;

  bool operator==(const GradientModel&) const = default;
};
static_assert(GradientModel::start(GradientModel::kLayers) ==
              std::tuple_size_v<decltype(GradientModel::numbers)>);

/// Writes a PyTorch (>= 1.6) state_dict: a zip with pickle protocol 2 that torch.load reads, also with
/// weights_only. The same model gives the same bytes. Throws Error when the disk does not take it.
void write_pth_model(const std::filesystem::path& path, const GradientModel& model);

/// Samples that the network evaluates together. Buffers are [neuron][sample].
inline constexpr int kNetworkTile = 64;
template <int Hidden>
struct alignas(64) PixelNetworkTile {
  template <int Neurons>
  using Values = std::array<float, static_cast<std::size_t>(Neurons) * kNetworkTile>;
  Values<5> input{};
  std::array<Values<Hidden>, 3> hidden{};
  Values<2> output{};
};
using NetworkTile = PixelNetworkTile<32>;

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

/// A network whose numbers no longer change, or the maker's network: also as angles, and `hidden` stays as it
/// is.
class FrozenNetwork {
 public:
  explicit FrozenNetwork(const GradientModel& network, int level = instruction_level())
      : network_(network), level_(level) {}
  /// Like network_forward().
  void forward(NetworkTile& tile) const;
  /// To be called after forward() on the same tile.
  void jacobian(const NetworkTile& tile, NetworkJacobian& result) const;

 private:
  void maker_jacobian(const NetworkTile& tile, NetworkJacobian& result) const;

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
      weight = static_cast<float>(normal() * std::sqrt(2.0 / GradientModel::kSizes[layer]));
  return network;
}

}  // namespace gelslam
