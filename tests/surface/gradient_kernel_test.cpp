#include "slopes/gradient_kernel.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "gelslam/core/error.hpp"
#include "linear_gel.hpp"
#include "pth_file.hpp"
#include "slopes/gradient_map.hpp"

namespace gelslam::test {
namespace {

using namespace surface::detail;

GradientModel random_model(std::uint64_t seed) { return {random_layers(seed)}; }

// The definition in double precision: network, then tangent.
std::array<double, 2> naive_gradient(const GradientModel& model, const std::array<double, 5>& features) {
  std::vector<double> values(features.begin(), features.end());
  for (std::size_t i = 0; i < model.layers.size(); ++i) {
    const GradientModel::Layer& layer = model.layers[i];
    std::vector<double> next;
    for (std::size_t o = 0; o < layer.bias.size(); ++o) {
      double sum = static_cast<double>(layer.bias[o]);
      for (std::size_t k = 0; k < values.size(); ++k) {
        sum += static_cast<double>(layer.weight[o * values.size() + k]) * values[k];
      }
      next.push_back(i + 1 < model.layers.size() ? std::max(sum, 0.0) : sum);
    }
    values = next;
  }
  return {std::tan(values[0]), std::tan(values[1])};
}

cv::Mat3b random_image(cv::Size size, std::uint64_t seed) {
  std::mt19937_64 random(seed);
  cv::Mat3b image(size);
  for (cv::Vec3b& pixel : image) {
    for (int c = 0; c < 3; ++c) pixel[c] = static_cast<unsigned char>(random());
  }
  return image;
}

cv::Mat1b everywhere(cv::Size size) { return cv::Mat1b(size, static_cast<unsigned char>(255)); }

TEST(GradientKernel, AgreesWithTheDefinitionInDoublePrecision) {
  const GradientModel model = random_model(5);
  const GradientWeights weights = pack_weights(model);
  std::mt19937_64 random(6);
  std::vector<float> features(gradient_features * gradient_tile_pixels), gx(gradient_tile_pixels), gy(gx);
  for (float& feature : features) feature = static_cast<float>(static_cast<double>(random() >> 11) * 0x1p-53);
  gradient_tile(weights, features.data(), gx.data(), gy.data());
  for (std::size_t p = 0; p < gradient_tile_pixels; ++p) {
    std::array<double, 5> pixel{};
    for (std::size_t f = 0; f < 5; ++f)
      pixel[f] = static_cast<double>(features[f * gradient_tile_pixels + p]);
    const auto expected = naive_gradient(model, pixel);
    ASSERT_NEAR(gx[p], expected[0], 2e-6 * (1 + std::abs(expected[0])));  // float sums of 32 terms
    ASSERT_NEAR(gy[p], expected[1], 2e-6 * (1 + std::abs(expected[1])));
  }
}

TEST(GradientKernel, TangentIsRightOverItsWholeRangeAndLimitedBeyond) {
  GradientModel model = linear_gel_model();
  const GradientWeights weights = pack_weights(model);
  std::vector<float> features(gradient_features * gradient_tile_pixels, 0.0F), gx(gradient_tile_pixels),
      gy(gx);
  const auto angle_of = [](int p) { return -1.8 + 3.6 * p / (gradient_tile_pixels - 1); };
  for (int p = 0; p < gradient_tile_pixels; ++p) {
    features[static_cast<std::size_t>(2 * gradient_tile_pixels + p)] =
        static_cast<float>((angle_of(p) / rad_per_level + bare_level) / 255.0);
  }
  gradient_tile(weights, features.data(), gx.data(), gy.data());
  for (int p = 0; p < gradient_tile_pixels; ++p) {
    const double expected = std::tan(std::clamp(angle_of(p), -1.5, 1.5));
    ASSERT_NEAR(gx[static_cast<std::size_t>(p)], expected, 1e-6 * (1 + expected * expected) * 3)
        << angle_of(p);
  }
}

TEST(GradientKernel, RefusesOtherNetworks) {
  EXPECT_THROW(pack_weights({random_layers(1, {5, 32, 32, 2})}), Error);
  EXPECT_THROW(pack_weights({random_layers(1, {5, 32, 16, 32, 2})}), Error);
}

TEST(GradientMap, UsesColorAndPlaceAsTheModelExpects) {
  const cv::Size size(37, 29);
  const GradientModel model = random_model(8);
  const cv::Mat3b background = random_image(size, 1), image = random_image(size, 2);
  GradientMap map(model, background);
  cv::Mat1f gx, gy;
  map.compute(image, color_table(Light{}), everywhere(size), gx, gy);
  const auto at = [&](const cv::Mat3b& picture, int v, int u) {
    const cv::Vec3b color = picture(v, u);
    return naive_gradient(model, {color[0] / 255.0, color[1] / 255.0, color[2] / 255.0,
                                  static_cast<double>(u) / size.width, static_cast<double>(v) / size.height});
  };
  for (int v = 0; v < size.height; ++v) {
    for (int u = 0; u < size.width; ++u) {
      ASSERT_NEAR(gx(v, u), at(image, v, u)[0] - at(background, v, u)[0], 1e-5);
      ASSERT_NEAR(gy(v, u), at(image, v, u)[1] - at(background, v, u)[1], 1e-5);
    }
  }
}

TEST(GradientMap, GivesTheSameBitsWhereverElseItRuns) {
  const cv::Size size(320, 240);
  GradientMap map(random_model(9), random_image(size, 3));
  const cv::Mat3b image = random_image(size, 4);
  const ColorTable colors = color_table({{1.1, 0.9, 1.0}, {3.0, -2.0, 0.5}});
  cv::Mat1f all_gx, all_gy, some_gx, some_gy;
  map.compute(image, colors, everywhere(size), all_gx, all_gy);
  cv::Mat1b some(size, static_cast<unsigned char>(0));
  std::mt19937_64 random(10);
  for (unsigned char& pixel : some) pixel = random() % 3 == 0 ? 255 : 0;
  map.compute(image, colors, some, some_gx, some_gy);
  for (int v = 0; v < size.height; ++v) {
    for (int u = 0; u < size.width; ++u) {
      const bool ran = some(v, u) != 0;
      ASSERT_EQ(some_gx(v, u), ran ? all_gx(v, u) : 0.0F);
      ASSERT_EQ(some_gy(v, u), ran ? all_gy(v, u) : 0.0F);
    }
  }
}

}  // namespace
}  // namespace gelslam::test
