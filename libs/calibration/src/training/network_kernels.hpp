#pragma once

#include <array>
#include <cstddef>

namespace gelslam::calibration::detail {

/// The network of the public systems, 5-32-32-32-2 with ReLU; or a gradient of its numbers, or Adam's
/// moments. Weights row-major [out][in].
struct NetworkNumbers {
  static constexpr std::array<int, 5> sizes = {5, 32, 32, 32, 2};
  static constexpr std::array<int, 5> weight_start = {0, 160, 1184, 2208, 2272};
  static constexpr std::array<int, 5> bias_start = {2272, 2304, 2336, 2368, 2370};
  static constexpr int count = 2370;

  std::array<float, count> values{};
  float* weight(std::size_t layer) { return values.data() + weight_start[layer]; }
  const float* weight(std::size_t layer) const { return values.data() + weight_start[layer]; }
  float* bias(std::size_t layer) { return values.data() + bias_start[layer]; }
  const float* bias(std::size_t layer) const { return values.data() + bias_start[layer]; }
};

inline constexpr int tile_samples = 64;

/// One tile of samples, neurons by samples.
struct alignas(64) TileActivations {
  std::array<float, 5 * tile_samples> input{};
  std::array<float, 32 * tile_samples> hidden1{}, hidden2{}, hidden3{};
  std::array<float, 2 * tile_samples> output{};
};

/// Outputs (and what backward needs) from `input`.
void network_forward(const NetworkNumbers& network, TileActivations& tile);

/// Adds the derivatives of the loss by the network's numbers; `d_output` is the loss's derivative by the
/// outputs.
void network_backward(const NetworkNumbers& network, const TileActivations& tile,
                      const std::array<float, 2 * tile_samples>& d_output, NetworkNumbers& gradient);

/// Kingma & Ba 2015; `rate` and `epsilon` hold the bias corrections.
void adam_step(NetworkNumbers& network, const NetworkNumbers& gradient, NetworkNumbers& first,
               NetworkNumbers& second, float rate, float epsilon);

}  // namespace gelslam::calibration::detail
