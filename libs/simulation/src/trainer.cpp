#include "gelslam/simulation/trainer.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "gelslam/core/error.hpp"
#include "network_kernels.hpp"
#include "random.hpp"

namespace gelslam {
namespace {

using namespace simulation::detail;

constexpr std::size_t layers = 4, tile = tile_samples;
constexpr auto& sizes = SimulatedNetwork::sizes;
constexpr std::size_t features = sizes.front(), outputs = sizes.back();

/// Weights, or their gradients, or Adam's moments: all of one shape.
SimulatedNetwork zeros() {
  SimulatedNetwork network;
  for (std::size_t l = 0; l < layers; ++l) {
    network.weight[l].assign(static_cast<std::size_t>(sizes[l] * sizes[l + 1]), 0.0F);
    network.bias[l].assign(static_cast<std::size_t>(sizes[l + 1]), 0.0F);
  }
  return network;
}

/// He's initialisation for ReLU layers.
SimulatedNetwork first_weights(Random& random) {
  SimulatedNetwork network = zeros();
  for (std::size_t l = 0; l < layers; ++l)
    for (float& w : network.weight[l]) w = static_cast<float>(random.normal() * std::sqrt(2.0 / sizes[l]));
  return network;
}

/// The neurons' outputs for one tile of samples, input included; and the same for the derivatives.
struct Activations {
  std::array<std::vector<float>, layers + 1> values;
  Activations() {
    for (std::size_t l = 0; l <= layers; ++l)
      values[l].assign(static_cast<std::size_t>(sizes[l]) * tile, 0.0F);
  }
};

void forward(const SimulatedNetwork& network, Activations& a) {
  for (std::size_t l = 0; l < layers; ++l) {
    affine(network.weight[l].data(), network.bias[l].data(), a.values[l].data(), a.values[l + 1].data(),
           sizes[l + 1], sizes[l]);
    if (l + 1 < layers) relu(a.values[l + 1].data(), sizes[l + 1]);
  }
}

/// Adds the gradient of one tile; `d.values[layers]` holds the loss's derivative by the outputs.
void backward(const SimulatedNetwork& network, const Activations& a, Activations& d,
              SimulatedNetwork& gradient) {
  for (std::size_t l = layers; l-- > 0;) {
    add_weight_gradient(d.values[l + 1].data(), a.values[l].data(), gradient.weight[l].data(), sizes[l + 1],
                        sizes[l]);
    for (std::size_t o = 0; o < gradient.bias[l].size(); ++o) {
      const float* row = d.values[l + 1].data() + o * tile;
      gradient.bias[l][o] += std::accumulate(row, row + tile, 0.0F);
    }
    if (l == 0) return;
    std::vector<float> transposed(network.weight[l].size());
    const auto rows = static_cast<std::size_t>(sizes[l + 1]), columns = static_cast<std::size_t>(sizes[l]);
    for (std::size_t o = 0; o < rows; ++o)
      for (std::size_t i = 0; i < columns; ++i) transposed[i * rows + o] = network.weight[l][o * columns + i];
    affine(transposed.data(), nullptr, d.values[l + 1].data(), d.values[l].data(), sizes[l], sizes[l + 1]);
    relu_backward(a.values[l].data(), d.values[l].data(), sizes[l]);
  }
}

class Trainer {
 public:
  Trainer(const TrainingSamples& samples, const TrainingOptions& options)
      : samples_(samples),
        options_(options),
        random_(options.seed),
        network_(first_weights(random_)),
        order_(samples.size()) {
    std::iota(order_.begin(), order_.end(), std::size_t{0});
  }

  SimulatedNetwork run() {
    const auto batch = static_cast<std::size_t>(options_.batch);
    for (int epoch = 0; epoch < options_.epochs; ++epoch) {
      for (std::size_t k = order_.size() - 1; k > 0; --k) std::swap(order_[k], order_[random_.below(k + 1)]);
      const double rate = options_.learning_rate * std::pow(0.5, epoch / options_.halve_every_epochs);
      for (std::size_t first = 0; first + batch <= order_.size(); first += batch) step(first, batch, rate);
    }
    return network_;
  }

 private:
  void step(std::size_t first, std::size_t batch, double rate) {
    SimulatedNetwork gradient = zeros();
    for (std::size_t k = 0; k < batch; k += tile) {
      load(first + k);
      forward(network_, activations_);
      set_loss_derivative(first + k, batch);
      backward(network_, activations_, derivatives_, gradient);
    }
    ++steps_;
    // Kingma & Ba's bias corrections, folded into the rate and epsilon.
    const double second = std::sqrt(1 - std::pow(0.999, steps_)), first_moment = 1 - std::pow(0.9, steps_);
    const auto step_rate = static_cast<float>(rate * second / first_moment),
               epsilon = static_cast<float>(1e-8 * second);
    for (std::size_t l = 0; l < layers; ++l) {
      adam(network_.weight[l].data(), gradient.weight[l].data(), first_.weight[l].data(),
           second_.weight[l].data(), static_cast<int>(network_.weight[l].size()), step_rate, epsilon);
      adam(network_.bias[l].data(), gradient.bias[l].data(), first_.bias[l].data(), second_.bias[l].data(),
           static_cast<int>(network_.bias[l].size()), step_rate, epsilon);
    }
  }

  void load(std::size_t first) {
    for (std::size_t k = 0; k < tile; ++k)
      for (std::size_t f = 0; f < features; ++f)
        activations_.values[0][f * tile + k] = samples_.features[order_[first + k] * features + f];
  }

  /// L1 loss, mean over batch and outputs.
  void set_loss_derivative(std::size_t first, std::size_t batch) {
    const float size = 1.0F / static_cast<float>(batch * outputs);
    for (std::size_t k = 0; k < tile; ++k)
      for (std::size_t o = 0; o < outputs; ++o) {
        const float error =
            activations_.values[layers][o * tile + k] - samples_.angles_rad[order_[first + k] * outputs + o];
        derivatives_.values[layers][o * tile + k] = error > 0 ? size : (error < 0 ? -size : 0.0F);
      }
  }

  const TrainingSamples& samples_;
  TrainingOptions options_;
  Random random_;
  SimulatedNetwork network_, first_ = zeros(), second_ = zeros();
  std::vector<std::size_t> order_;
  Activations activations_, derivatives_;
  int steps_ = 0;
};

std::array<float, features> feature_vector(const cv::Mat3b& bgr, int u, int v) {
  const cv::Vec3b& c = bgr(v, u);
  return {static_cast<float>(c[0]) / 255.0F, static_cast<float>(c[1]) / 255.0F,
          static_cast<float>(c[2]) / 255.0F, static_cast<float>(u) / static_cast<float>(bgr.cols),
          static_cast<float>(v) / static_cast<float>(bgr.rows)};
}

}  // namespace

void TrainingSamples::add(const cv::Mat3b& bgr, int u, int v, float angle_x_rad, float angle_y_rad) {
  const auto vector = feature_vector(bgr, u, v);
  features.insert(features.end(), vector.begin(), vector.end());
  angles_rad.insert(angles_rad.end(), {angle_x_rad, angle_y_rad});
}

SimulatedNetwork train_network(const TrainingSamples& samples, const TrainingOptions& options) {
  if (options.epochs < 1 || options.epochs > 10'000)
    throw Error("number of training epochs must be between 1 and 10000");
  if (options.batch < tile_samples || options.batch % tile_samples != 0)
    throw Error("training batch must be a multiple of " + std::to_string(tile_samples));
  if (!(options.learning_rate > 0 && options.learning_rate < 1) || options.halve_every_epochs < 1)
    throw Error("learning rate must be between 0 and 1, and halved after at least one epoch");
  if (samples.features.size() != samples.size() * features)
    throw Error("training samples need 5 features and 2 angles each");
  if (samples.size() < static_cast<std::size_t>(options.batch))
    throw Error("fewer training samples than one batch");
  return Trainer(samples, options).run();
}

cv::Mat2f read_slopes(const SimulatedNetwork& network, const cv::Mat3b& bgr) {
  cv::Mat2f slopes(bgr.size());
  Activations a;
  const std::size_t pixels = bgr.total();
  const auto width = static_cast<std::size_t>(bgr.cols);
  for (std::size_t first = 0; first < pixels; first += tile) {
    const std::size_t count = std::min(tile, pixels - first);
    for (std::size_t k = 0; k < count; ++k) {
      const auto vector =
          feature_vector(bgr, static_cast<int>((first + k) % width), static_cast<int>((first + k) / width));
      for (std::size_t f = 0; f < features; ++f) a.values[0][f * tile + k] = vector[f];
    }
    forward(network, a);
    for (std::size_t k = 0; k < count; ++k)
      slopes(static_cast<int>((first + k) / width), static_cast<int>((first + k) % width)) = {
          std::tan(a.values[layers][k]), std::tan(a.values[layers][tile + k])};
  }
  return slopes;
}

}  // namespace gelslam
