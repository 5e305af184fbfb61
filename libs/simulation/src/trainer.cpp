#include <algorithm>
#include <cmath>
#include <numeric>

#include "gelslam/core/error.hpp"
#include "gelslam/simulation/calibration_set.hpp"
#include "random.hpp"

namespace gelslam {
namespace {

using namespace simulation::detail;

constexpr std::size_t kTile = kNetworkTile;
constexpr std::size_t kFeatures = GradientModel::kSizes.front(), kOutputs = GradientModel::kSizes.back();

class Trainer {
 public:
  Trainer(const TrainingSamples& samples, const TrainingOptions& options)
      : samples_(samples),
        options_(options),
        random_(options.seed),
        network_(initial_network([this] { return random_.normal(); })),
        order_(samples.size()) {
    std::iota(order_.begin(), order_.end(), std::size_t{0});
  }

  GradientModel run(ProgressSink& progress) {
    progress.begin("training the gradient network", options_.epochs);
    const auto batch = static_cast<std::size_t>(options_.batch);
    for (int epoch = 0; epoch < options_.epochs; ++epoch) {
      for (std::size_t k = order_.size() - 1; k > 0; --k) std::swap(order_[k], order_[random_.below(k + 1)]);
      const double rate = options_.learning_rate * std::pow(0.5, epoch / options_.halve_every_epochs);
      for (std::size_t first = 0; first + batch <= order_.size(); first += batch) step(first, batch, rate);
      progress.update(epoch + 1);
    }
    progress.end();
    return network_;
  }

 private:
  void step(std::size_t first, std::size_t batch, double rate) {
    GradientModel gradient;
    for (std::size_t k = 0; k < batch; k += kTile) {
      load(first + k);
      network_forward(network_, tile_);
      set_loss_derivative(first + k, batch);
      network_backward(network_, tile_, derivatives_, gradient);
    }
    adam_.step(network_, gradient, rate);
  }

  void load(std::size_t first) {
    for (std::size_t k = 0; k < kTile; ++k)
      for (std::size_t f = 0; f < kFeatures; ++f)
        tile_.input[f * kTile + k] = samples_.features[order_[first + k] * kFeatures + f];
  }

  /// L1 loss, mean over batch and outputs.
  void set_loss_derivative(std::size_t first, std::size_t batch) {
    const float size = 1.0F / static_cast<float>(batch * kOutputs);
    for (std::size_t k = 0; k < kTile; ++k)
      for (std::size_t o = 0; o < kOutputs; ++o) {
        const float error =
            tile_.output[o * kTile + k] - samples_.angles_rad[order_[first + k] * kOutputs + o];
        derivatives_[o * kTile + k] = error > 0 ? size : (error < 0 ? -size : 0.0F);
      }
  }

  const TrainingSamples& samples_;
  TrainingOptions options_;
  Random random_;
  GradientModel network_;
  Adam adam_;
  std::vector<std::size_t> order_;
  NetworkTile tile_;
  NetworkTile::Values<kOutputs> derivatives_{};
};

std::array<float, kFeatures> feature_vector(const cv::Mat3b& bgr, int u, int v) {
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

GradientModel train_network(const TrainingSamples& samples, const TrainingOptions& options,
                            ProgressSink& progress) {
  if (options.epochs < 1 || options.epochs > 10'000)
    throw Error("number of training epochs must be between 1 and 10000");
  if (options.batch < kNetworkTile || options.batch % kNetworkTile != 0)
    throw Error("training batch must be a multiple of " + std::to_string(kNetworkTile));
  if (!(options.learning_rate > 0 && options.learning_rate < 1) || options.halve_every_epochs < 1)
    throw Error("learning rate must be between 0 and 1, and halved after at least one epoch");
  if (samples.features.size() != samples.size() * kFeatures)
    throw Error("training samples need 5 features and 2 angles each");
  if (samples.size() < static_cast<std::size_t>(options.batch))
    throw Error("fewer training samples than one batch");
  return Trainer(samples, options).run(progress);
}

cv::Mat2f read_slopes(const GradientModel& network, const cv::Mat3b& bgr) {
  cv::Mat2f slopes(bgr.size());
  NetworkTile tile;
  const std::size_t pixels = bgr.total();
  const auto width = static_cast<std::size_t>(bgr.cols);
  for (std::size_t first = 0; first < pixels; first += kTile) {
    const std::size_t count = std::min(kTile, pixels - first);
    for (std::size_t k = 0; k < count; ++k) {
      const auto vector =
          feature_vector(bgr, static_cast<int>((first + k) % width), static_cast<int>((first + k) / width));
      for (std::size_t f = 0; f < kFeatures; ++f) tile.input[f * kTile + k] = vector[f];
    }
    network_forward(network, tile);
    for (std::size_t k = 0; k < count; ++k)
      slopes(static_cast<int>((first + k) / width), static_cast<int>((first + k) % width)) = {
          std::tan(tile.output[k]), std::tan(tile.output[kTile + k])};
  }
  return slopes;
}

}  // namespace gelslam
