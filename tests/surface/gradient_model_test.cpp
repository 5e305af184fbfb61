#include "gelslam/surface/gradient_model.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdint>
#include <fstream>
#include <random>
#include <sstream>
#include <string>

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

/// Sum of squares of the outputs: its derivative by the outputs is twice the outputs.
double loss(const GradientModel& network, NetworkTile tile) {
  network_forward(network, tile);
  double sum = 0.0;
  for (const float value : tile.output) sum += static_cast<double>(value) * static_cast<double>(value);
  return sum;
}

TEST(NetworkForward, AgreesWithTheGoldenFile) {
  GradientModel network;
  for (std::size_t k = 0; k < network.numbers.size(); ++k) {
    const auto hash = static_cast<std::uint32_t>(k * 2654435761ULL);
    network.numbers[k] = static_cast<float>((hash / 4294967296.0 - 0.5) * 0.8);
  }
  std::ifstream file(GELSLAM_SURFACE_TEST_DATA "/gradient_model_golden.txt");
  std::string line;
  int samples = 0;
  while (std::getline(file, line)) {
    if (line.starts_with("#")) continue;
    NetworkTile tile;
    std::istringstream words(line);
    for (std::size_t f = 0; f < 5; ++f) words >> tile.input[f * kNetworkTile + 9];
    double angle_x = 0.0, angle_y = 0.0;
    ASSERT_TRUE(words >> angle_x >> angle_y) << line;
    network_forward(network, tile);
    EXPECT_NEAR(tile.output[9], angle_x, 2e-6) << line;  // float sums of 32 terms
    EXPECT_NEAR(tile.output[kNetworkTile + 9], angle_y, 2e-6) << line;
    ++samples;
  }
  EXPECT_EQ(samples, 12);
}

TEST(NetworkForward, GivesTheSameBitsAtEveryPlaceOfATile) {
  std::mt19937 random(3);
  const GradientModel network = random_network(random);
  NetworkTile tile = random_tile(random);
  for (std::size_t f = 0; f < 5; ++f)
    for (std::size_t k = 0; k < kNetworkTile; ++k)
      tile.input[f * kNetworkTile + k] = tile.input[f * kNetworkTile];
  network_forward(network, tile);
  for (std::size_t k = 0; k < tile.output.size(); ++k)
    ASSERT_EQ(tile.output[k], tile.output[k / kNetworkTile * kNetworkTile]) << k;
}

// Each instruction set has a kernel of its own, of which this processor would otherwise run one.
TEST(Network, GivesTheSameAtEveryInstructionLevel) {
  std::mt19937 random(4);
  const GradientModel network = random_network(random);
  const NetworkTile inputs = random_tile(random);
  NetworkTile lowest = inputs;
  NetworkJacobian by_input;
  GradientModel by_number;
  network_forward(network, lowest, 1);
  FrozenNetwork(network, 1).jacobian(lowest, by_input);
  network_backward(network, lowest, lowest.output, by_number, 1);
  for (int level = 3; level <= instruction_level(); ++level) {
    NetworkTile tile = inputs;
    NetworkJacobian jacobian;
    GradientModel gradient;
    network_forward(network, tile, level);
    FrozenNetwork(network, level).jacobian(lowest, jacobian);
    network_backward(network, lowest, lowest.output, gradient, level);
    // Float sums of 32 terms (forward) and of 64 samples (backward), in another order and with fused
    // products.
    for (std::size_t k = 0; k < tile.output.size(); ++k)
      ASSERT_NEAR(tile.output[k], lowest.output[k], 2e-6F) << "level " << level << ", " << k;
    for (std::size_t o = 0; o < 2; ++o)
      for (std::size_t k = 0; k < by_input.of_output[o].size(); ++k)
        ASSERT_NEAR(jacobian.of_output[o][k], by_input.of_output[o][k], 2e-6F) << "level " << level;
    for (std::size_t k = 0; k < by_number.numbers.size(); ++k)
      ASSERT_NEAR(gradient.numbers[k], by_number.numbers[k], 1e-4F) << "level " << level << ", " << k;
  }
}

TEST(FrozenNetwork, DerivativesOfTheMakersNetworkAreThoseOfFiniteDifferences) {
  std::mt19937 random(9);
  std::uniform_real_distribution<float> number(-0.12F, 0.12F);
  GradientModel network;
  std::vector<float>& numbers = network.wide.emplace().numbers;
  network.wide->shape = {{5, 64, 64, 64, 2}};
  network.wide->gives_normals = true;
  for (std::size_t k = 0; k < 8832; ++k) numbers.push_back(number(random));
  numbers.insert(numbers.end(), {0.5F, -0.4F});
  for (int level = 1; level <= instruction_level(); ++level) {
    const FrozenNetwork frozen(network, level);
    const NetworkTile tile = random_tile(random);
    NetworkJacobian jacobian;
    frozen.jacobian(tile, jacobian);
    for (std::size_t input = 0; input < 5; ++input) {
      constexpr float step = 1e-2F;
      NetworkTile more = tile, less = tile;
      for (std::size_t p = input * kNetworkTile; p < (input + 1) * kNetworkTile; ++p) {
        more.input[p] += step;
        less.input[p] -= step;
      }
      frozen.forward(more);
      frozen.forward(less);
      for (std::size_t o = 0; o < 2; ++o)
        for (std::size_t p = 0; p < kNetworkTile; ++p) {
          const std::size_t at = o * kNetworkTile + p;
          ASSERT_NEAR(jacobian.of_output[o][input * kNetworkTile + p],
                      (more.output[at] - less.output[at]) / (2 * step), 4e-3F)
              << "level " << level;
        }
    }
  }
}

TEST(NetworkBackward, DerivativesAreThoseOfFiniteDifferences) {
  std::mt19937 random(5);
  const GradientModel network = random_network(random);
  NetworkTile tile = random_tile(random);
  network_forward(network, tile);
  NetworkTile::Values<2> derivative{};
  for (std::size_t k = 0; k < derivative.size(); ++k) derivative[k] = 2.0F * tile.output[k];
  GradientModel gradient;
  network_backward(network, tile, derivative, gradient);
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
  EXPECT_LT(std::sqrt(difference / size), 0.01);  // kinks of the ReLU
}

// The first step of Adam goes by the learning rate against the sign of each derivative, whatever its size;
// with a constant gradient every later step does the same.
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
