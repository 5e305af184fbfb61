#include "heights/poisson.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <opencv2/core.hpp>
#include <random>

#include "heights/normals.hpp"
#include "linear_gel.hpp"

namespace gelslam::test {
namespace {

using surface::detail::PoissonSolver;

using Function = std::function<double(double, double)>;

cv::Mat1f sample(cv::Size size, const Function& function) {
  cv::Mat1f map(size);
  for (int v = 0; v < size.height; ++v) {
    for (int u = 0; u < size.width; ++u) map(v, u) = static_cast<float>(function(u, v));
  }
  return map;
}

// Largest difference between the solved and the true height, both with zero mean.
double largest_error(cv::Size size, const Function& height, const Function& gx, const Function& gy) {
  PoissonSolver solver(size);
  const cv::Mat1f solved = solver.pixels(solver.solve(sample(size, gx), sample(size, gy)));
  const cv::Mat1f truth = sample(size, height);
  const double solved_mean = cv::mean(solved)[0], true_mean = cv::mean(truth)[0];
  double largest = 0.0;
  for (int v = 0; v < size.height; ++v) {
    for (int u = 0; u < size.width; ++u) {
      largest = std::max(largest, std::abs(solved(v, u) - solved_mean - truth(v, u) + true_mean));
    }
  }
  return largest;
}

// Mean edge gradients of a quadratic are its exact differences, so only float rounding remains (heights up to
// 64 px).
TEST(Poisson, QuadraticHeightsComeBackExactlyAtEverySize) {
  for (const cv::Size size :
       {kSensor, cv::Size(161, 121), cv::Size(162, 121), cv::Size(33, 240), cv::Size(16, 16)}) {
    const auto ramp = [](double u, double v) { return 0.2 * u - 0.1 * v; };
    EXPECT_LT(largest_error(
                  size, ramp, [](double, double) { return 0.2; }, [](double, double) { return -0.1; }),
              2e-3)
        << size;
    const auto bowl = [](double u, double v) { return 0.001 * u * u - 0.0005 * v * v + 0.0004 * u * v; };
    EXPECT_LT(largest_error(
                  size, bowl, [](double u, double v) { return 0.002 * u + 0.0004 * v; },
                  [](double u, double v) { return -0.001 * v + 0.0004 * u; }),
              5e-3)
        << size;
  }
}

// For any gradients, even such that no height has: what is left over between squares of four pixels has no
// divergence (normal equations). From the middle of a square to that of the next lie half an edge between
// pixels, a whole one and half a one, in two rows.
TEST(Poisson, SolvesTheLeastSquaresProblemForInconsistentGradients) {
  const cv::Size size(64, 48);
  std::mt19937_64 random(3);
  const auto noise = [&](double, double) { return static_cast<double>(random() >> 11) * 0x1p-53 - 0.5; };
  const cv::Mat1f gx = sample(size, noise), gy = sample(size, noise);
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
