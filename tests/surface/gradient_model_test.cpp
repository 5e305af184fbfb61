#include "gelslam/surface/gradient_model.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

namespace gelslam {
namespace {

GradientModel random_network(std::mt19937& random) {
  GradientModel network;
  std::uniform_real_distribution<float> number(-0.4F, 0.4F);
  for (float& value : network.numbers) value = number(random);
  return network;
}

NetworkTile random_tile(std::mt19937& random) {
  NetworkTile tile;
  std::uniform_real_distribution<float> number(-1.0F, 1.0F);
  for (float& value : tile.input) value = number(random);
  return tile;
}

/// Returns the loss of the test, the sum of squares of the outputs. Its derivative by the outputs is twice
/// the outputs.
double loss(const GradientModel& network, NetworkTile tile) {
  network_forward(network, tile);
  double sum = 0.0;
  for (const float value : tile.output) sum += static_cast<double>(value) * static_cast<double>(value);
  return sum;
}

// There is a kernel for each instruction set, and all that this processor supports are tested.
TEST(NetworkBackward, DerivativesAreThoseOfFiniteDifferences) {
  std::mt19937 random(5);
  const GradientModel network = random_network(random);
  NetworkTile tile = random_tile(random);
  network_forward(network, tile);
  NetworkTile::Values<2> derivative{};
  for (std::size_t k = 0; k < derivative.size(); ++k) derivative[k] = 2.0F * tile.output[k];
  for (int level = 1; level <= instruction_level(); ++level) {
    GradientModel gradient;
    network_backward(network, tile, derivative, gradient, level);
    double difference = 0.0, size = 0.0;
    for (std::size_t k = 0; k < network.numbers.size(); k += 7) {
      GradientModel more = network, less = network;
      constexpr float step = 2e-3F;
      more.numbers[k] += step;
      less.numbers[k] -= step;
      const double numerical = (loss(more, tile) - loss(less, tile)) / (2.0 * static_cast<double>(step));
      difference += std::pow(numerical - static_cast<double>(gradient.numbers[k]), 2);
      size += numerical * numerical;
    }
    EXPECT_GT(size, 1.0);
    EXPECT_LT(std::sqrt(difference / size), 0.01) << level;  // kinks of the ReLU
  }
}

// The first step of Adam has the length of the learning rate, against the sign of each derivative, whatever
// its size. With a constant gradient, each later step is the same.
TEST(Adam, StepsByTheLearningRate) {
  GradientModel network, gradient;
  for (std::size_t k = 0; k < gradient.numbers.size(); ++k)
    gradient.numbers[k] = k % 3 == 0 ? 0.0F : (k % 3 == 1 ? 250.0F : -0.004F);
  Adam adam;
  for (int step = 1; step <= 3; ++step) {
    adam.step(network, gradient, 0.01);
    const float way = 0.01F * static_cast<float>(step);
    ASSERT_EQ(network.numbers[0], 0.0F);
    EXPECT_NEAR(network.numbers[1], -way, 1e-5F);
    EXPECT_NEAR(network.numbers[2], way, 1e-5F);
  }
}

}  // namespace
}  // namespace gelslam
