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

cv::Mat3b scaled(const cv::Mat3b& image, double factor) {
  cv::Mat3b result;
  image.convertTo(result, CV_8U, factor);
  return result;
}

/// Evaluates the network in double precision, directly by its definition.
cv::Vec2d slopes_at(const PthFile& file, const cv::Mat3b& picture, int u, int v) {
  const cv::Vec3b color = picture(v, u);
  const auto angles = naive_angles(file, {color[0] / 255.0, color[1] / 255.0, color[2] / 255.0,
                                          1.0 * u / picture.cols, 1.0 * v / picture.rows});
  return {std::tan(angles[0]), std::tan(angles[1])};
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
  for (int v = 0; v < size.height; ++v)
    for (int u = 0; u < size.width; ++u) {
      const cv::Vec2d change = slopes_at(file, image, u, v) - slopes_at(file, background, u, v);
      ASSERT_NEAR(gx(v, u), change[0], kRounding);
      ASSERT_NEAR(gy(v, u), change[1], kRounding);
    }
}

TEST(GradientMap, ReadsTheSameSlopesAtHalfTheExposure) {
  const cv::Size size(37, 29);
  GradientModel model = random_model(8);
  const cv::Mat3b dark_background = scaled(random_image(size, 1), 0.49),
                  dark_image = scaled(random_image(size, 2), 0.49), background = scaled(dark_background, 2),
                  image = scaled(dark_image, 2);
  model.bare_gel_bgr = mean_color(background);
  cv::Mat1f gx, gy, dark_gx, dark_gy;
  GradientMap(model, background).compute(image, color_table(Light{}), all_blocks(size), gx, gy);
  GradientMap(model, dark_background)
      .compute(dark_image, color_table(Light{}), all_blocks(size), dark_gx, dark_gy);
  constexpr double kRounding = 1e-4;  // of factors to 16 bits, where the processor multiplies matrices
  EXPECT_LT(cv::norm(gx, dark_gx, cv::NORM_INF), kRounding);
  EXPECT_LT(cv::norm(gy, dark_gy, cv::NORM_INF), kRounding);
  EXPECT_GT(cv::norm(gx, cv::NORM_INF), 0.1);
}

TEST(GradientMap, ReadsTheMakersNetworkAsItsNormalsLessTheBareGel) {
  const PthFile file = makers_file(5);
  const std::string bytes = zip_archive(file.entries());
  const GradientModel model =
      parse_pth_model({reinterpret_cast<const unsigned char*>(bytes.data()), bytes.size()}, "nnmini.pt");
  const cv::Size size(64, 48);
  const cv::Mat3b bare = random_image(size, 1);
  const auto smooth = pixel_map<cv::Vec3b>(size, [](int u, int v) {  // whole blocks are read by derivatives
    return cv::Vec3d(60 + 2 * u, 200 - 3 * v, 40 + u + 2 * v);
  });
  for (const auto& [image, tolerance] : {std::pair(random_image(size, 2), 1e-5), std::pair(smooth, 7e-3)}) {
    GradientMap map(model, bare);
    cv::Mat1f gx, gy;
    map.compute(image, color_table(Light{}), all_blocks(size), gx, gy);
    double steepest = 0;
    for (int v = 0; v < size.height; ++v)
      for (int u = 0; u < size.width; ++u) {
        const cv::Vec2d touched = slopes_at(file, image, u, v),
                        change = touched - slopes_at(file, bare, u, v);
        ASSERT_NEAR(gx(v, u), 0.868 * change[0] - 0.048 * change[1], tolerance);  // as the SDK scales them
        ASSERT_NEAR(gy(v, u), -0.057 * change[0] + 1.102 * change[1], tolerance);
        steepest = std::max({steepest, std::abs(touched[0]), std::abs(touched[1])});
      }
    EXPECT_GT(steepest, 0.3);
  }
}

}  // namespace
}  // namespace gelslam::test
