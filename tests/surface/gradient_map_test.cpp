#include "slopes/gradient_map.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "gelslam/surface/model_file.hpp"
#include "linear_gel.hpp"
#include "photometry/blocks.hpp"
#include "pth_file.hpp"

namespace gelslam::test {
namespace {

using namespace surface::detail;

cv::Mat3b random_image(cv::Size size, std::uint64_t seed) {
  std::mt19937_64 random(seed);
  cv::Mat3b image(size);
  for (cv::Vec3b& pixel : image) {
    for (int c = 0; c < 3; ++c) pixel[c] = static_cast<unsigned char>(random());
  }
  return image;
}

TEST(GradientMap, UsesColorAndPlaceAsTheModelExpects) {
  const cv::Size size(37, 29);
  const GradientModel model = random_model(8);
  const cv::Mat3b background = random_image(size, 1), image = random_image(size, 2);
  GradientMap map(model, background);
  cv::Mat1f gx, gy;
  map.compute(image, color_table(Light{}), surface::detail::all_blocks(size), gx, gy);
  constexpr double kRounding = 1e-4;  // of factors to 16 bits, where the processor multiplies matrices
  PthFile file;
  file.layers = layers_of(model);
  const auto at = [&](const cv::Mat3b& picture, int v, int u) {
    const cv::Vec3b color = picture(v, u);
    const auto angles = naive_outputs(file, {color[0] / 255.0, color[1] / 255.0, color[2] / 255.0,
                                             1.0 * u / size.width, 1.0 * v / size.height});
    return std::array{std::tan(angles[0]), std::tan(angles[1])};
  };
  for (int v = 0; v < size.height; ++v) {
    for (int u = 0; u < size.width; ++u) {
      ASSERT_NEAR(gx(v, u), at(image, v, u)[0] - at(background, v, u)[0], kRounding);
      ASSERT_NEAR(gy(v, u), at(image, v, u)[1] - at(background, v, u)[1], kRounding);
    }
  }
}

/// The SDK's definition: two components of a unit normal, then the slopes.
std::array<double, 2> naive_maker_gradient(const PthFile& file, const cv::Mat3b& picture, int v, int u) {
  const cv::Vec3b& color = picture(v, u);
  const auto n =
      naive_outputs(file, {color[0] / 255.0, color[1] / 255.0, color[2] / 255.0,
                           static_cast<double>(v) / picture.rows, static_cast<double>(u) / picture.cols});
  const double z = std::sqrt(1.0 - n[0] * n[0] - n[1] * n[1]);
  return {(0.868 * n[0] - 0.048 * n[1]) / z, (-0.057 * n[0] + 1.102 * n[1]) / z};
}

TEST(GradientMap, ReadsTheMakersNetworkAsItsNormalsLessTheBareGel) {
  PthFile file;
  file.layers = random_maker_layers(5);
  file.checkpoint = true;
  const std::string bytes = zip_archive(file.entries());
  const GradientModel model =
      parse_pth_model({reinterpret_cast<const unsigned char*>(bytes.data()), bytes.size()}, "nnmini.pt");
  const cv::Size size(64, 48);
  const cv::Mat3b bare = random_image(size, 1);
  cv::Mat3b smooth(size);  // whole blocks are read by derivatives
  for (int v = 0; v < size.height; ++v)
    for (int u = 0; u < size.width; ++u)
      smooth(v, u) = cv::Vec3b(cv::saturate_cast<uchar>(60 + 2 * u), cv::saturate_cast<uchar>(200 - 3 * v),
                               cv::saturate_cast<uchar>(40 + u + 2 * v));
  for (const auto& [image, tolerance] : {std::pair(random_image(size, 2), 1e-5), std::pair(smooth, 7e-3)}) {
    GradientMap map(model, bare);
    cv::Mat1f gx, gy;
    map.compute(image, color_table(Light{}), all_blocks(size), gx, gy);
    double steepest = 0;
    for (int v = 0; v < size.height; ++v)
      for (int u = 0; u < size.width; ++u) {
        const auto touched = naive_maker_gradient(file, image, v, u),
                   untouched = naive_maker_gradient(file, bare, v, u);
        ASSERT_NEAR(gx(v, u), touched[0] - untouched[0], tolerance);
        ASSERT_NEAR(gy(v, u), touched[1] - untouched[1], tolerance);
        steepest = std::max({steepest, std::abs(touched[0]), std::abs(touched[1])});
      }
    EXPECT_GT(steepest, 0.3);
  }
}

TEST(GradientMap, GivesTheSameBitsWhereverElseItRuns) {
  const cv::Size size(320, 240);
  GradientMap map(random_model(9), random_image(size, 3));
  const cv::Mat3b image = random_image(size, 4);
  Light light;
  light.channels = {{{1.1, 3.0}, {0.9, -2.0}, {1.0, 0.5}}};
  const ColorTable colors = color_table(light);
  cv::Mat1f all_gx, all_gy, some_gx, some_gy;
  map.compute(image, colors, surface::detail::all_blocks(size), all_gx, all_gy);
  cv::Mat1b some = surface::detail::all_blocks(size);
  std::mt19937_64 random(10);
  for (unsigned char& block : some) block = random() % 3 == 0 ? 255 : 0;
  map.compute(image, colors, some, some_gx, some_gy);
  for (int v = 0; v < size.height; ++v) {
    for (int u = 0; u < size.width; ++u) {
      const bool ran = some(v / surface::detail::kBlockPx, u / surface::detail::kBlockPx) != 0;
      ASSERT_EQ(some_gx(v, u), ran ? all_gx(v, u) : 0.0F);
      ASSERT_EQ(some_gy(v, u), ran ? all_gy(v, u) : 0.0F);
    }
  }
}

}  // namespace
}  // namespace gelslam::test
