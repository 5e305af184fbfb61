#include "heights/poisson.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <opencv2/core.hpp>
#include <random>

#include "heights/normals.hpp"
#include "linear_gel.hpp"

namespace gelslam::test {
namespace {

using surface::detail::PoissonSolver;

/// Returns the largest difference between solved and true heights, both minus their means.
template <typename Height, typename SlopeX, typename SlopeY>
double largest_error(const cv::Size& size, const Height& height, const SlopeX& gx, const SlopeY& gy) {
  PoissonSolver solver(size);
  const cv::Mat1f solved =
                      solver.pixels(solver.solve(pixel_map<float>(size, gx), pixel_map<float>(size, gy))),
                  truth = pixel_map<float>(size, height);
  return cv::norm(solved - cv::mean(solved), truth - cv::mean(truth), cv::NORM_INF);
}

// For a quadratic surface, the mean of two neighboring gradients is exactly the height difference, so only
// rounding errors remain (the heights reach 64 pixels).
TEST(Poisson, QuadraticHeightsComeBackExactlyAtEverySize) {
  for (const cv::Size size :
       {kSensor, cv::Size(161, 121), cv::Size(162, 121), cv::Size(33, 240), cv::Size(16, 16)}) {
    const auto ramp = [](int u, int v) { return 0.2 * u - 0.1 * v; };
    EXPECT_LT(largest_error(
                  size, ramp, [](int, int) { return 0.2; }, [](int, int) { return -0.1; }),
              2e-3)
        << size;
    const auto bowl = [](int u, int v) { return 0.001 * u * u - 0.0005 * v * v + 0.0004 * u * v; };
    const auto bowl_x = [](int u, int v) { return 0.002 * u + 0.0004 * v; };
    const auto bowl_y = [](int u, int v) { return -0.001 * v + 0.0004 * u; };
    EXPECT_LT(largest_error(size, bowl, bowl_x, bowl_y), 5e-3) << size;
  }
}

// The gradients are random and have curl, so no surface has them. The normal equations say that the residuals
// of the height differences between squares of 2x2 pixels have no divergence. Between the centers of two
// squares, there are a half, a whole and a half difference of pixels, in two rows.
TEST(Poisson, SolvesTheLeastSquaresProblemForInconsistentGradients) {
  const cv::Size size(64, 48);
  std::mt19937_64 random(3);
  const auto noise = [&](int, int) { return uniform(random, -0.5, 0.5); };
  const cv::Mat1f gx = pixel_map<float>(size, noise), gy = pixel_map<float>(size, noise);
  PoissonSolver solver(size);
  const cv::Mat1f height = solver.solve(gx, gy);
  const auto edge_x = [&](int v, int u) {  // from (u,v) to (u+1,v)
    return 0.5 * (static_cast<double>(gx(v, u)) + gx(v, u + 1));
  };
  const auto edge_y = [&](int v, int u) { return 0.5 * (static_cast<double>(gy(v, u)) + gy(v + 1, u)); };
  const auto flux_x = [&](int v, int u) {  // leftover from square (u,v) to (u+1,v)
    if (u < 0 || u + 1 >= height.cols) return 0.0;
    double step = 0.0;
    for (int row = 2 * v; row < 2 * v + 2; ++row)
      step += 0.5 * (0.5 * edge_x(row, 2 * u) + edge_x(row, 2 * u + 1) + 0.5 * edge_x(row, 2 * u + 2));
    return step - (static_cast<double>(height(v, u + 1)) - height(v, u));
  };
  const auto flux_y = [&](int v, int u) {
    if (v < 0 || v + 1 >= height.rows) return 0.0;
    double step = 0.0;
    for (int column = 2 * u; column < 2 * u + 2; ++column)
      step +=
          0.5 * (0.5 * edge_y(2 * v, column) + edge_y(2 * v + 1, column) + 0.5 * edge_y(2 * v + 2, column));
    return step - (static_cast<double>(height(v + 1, u)) - height(v, u));
  };
  for (int v = 0; v < height.rows; ++v) {
    for (int u = 0; u < height.cols; ++u) {
      ASSERT_NEAR(flux_x(v, u) - flux_x(v, u - 1) + flux_y(v, u) - flux_y(v - 1, u), 0.0, 2e-4)
          << u << "," << v;
    }
  }
}

}  // namespace
}  // namespace gelslam::test
