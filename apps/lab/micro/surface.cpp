// Time of each stage from color to surface at the sensor's own 320x240, one thread. The picture is a press
// made from formulas: color follows slope, so the share of changed pixels is what a contact of 9 mm gives
// (about a half).

#include <benchmark/benchmark.h>

#include <algorithm>
#include <cmath>
#include <opencv2/core.hpp>
#include <random>

#include "heights/poisson.hpp"
#include "photometry/blocks.hpp"
#include "photometry/light.hpp"
#include "slopes/gradient_map.hpp"
#include "studies/simulated_frames.hpp"

namespace gelslam {
namespace {

using namespace surface::detail;

constexpr int kWidthPx = 320, kHeightPx = 240;

GradientModel random_model() {
  GradientModel model;
  std::mt19937_64 random(1);
  for (float& number : model.numbers)
    number = static_cast<float>(static_cast<double>(random() >> 11) * 0x1p-53 * 0.4 - 0.2);
  return model;
}

const cv::Mat3b& background() {
  static const cv::Mat3b image(kHeightPx, kWidthPx, cv::Vec3b(105, 95, 78));
  return image;
}

cv::Mat3b press() {
  cv::Mat3b image(kHeightPx, kWidthPx);
  for (int v = 0; v < kHeightPx; ++v) {
    for (int u = 0; u < kWidthPx; ++u) {
      const double x = (u - 160) / 45.0, y = (v - 120) / 45.0, bell = std::exp(-0.5 * (x * x + y * y));
      image(v, u) = cv::Vec3b(cv::saturate_cast<uchar>(105 + 50 * x * bell),
                              cv::saturate_cast<uchar>(95 + 40 * y * bell),
                              cv::saturate_cast<uchar>(78 - 50 * x * bell));
    }
  }
  return image;
}

void gradient(benchmark::State& state) {
  const cv::Mat3b image = press();
  GradientMap map(random_model(), background());
  const ColorTable colors = color_table(Light{});
  cv::Mat1b blocks = all_blocks(image.size());
  blocks.rowRange(blocks.rows * static_cast<int>(state.range(0)) / 100, blocks.rows).setTo(0);
  cv::Mat1f gx, gy;
  for (auto _ : state) {
    map.compute(image, colors, blocks, gx, gy);
    benchmark::DoNotOptimize(gx.data);
  }
}

/// Network and tangent of one pixel in double precision.
cv::Vec2d slopes_in_double(const GradientModel& model, std::vector<double> values) {
  for (std::size_t layer = 0; layer < GradientModel::kLayers; ++layer) {
    std::vector<double> next;
    for (std::size_t o = 0; o < GradientModel::kShape.outputs(layer); ++o) {
      double sum = static_cast<double>(model.bias(layer)[o]);
      for (std::size_t i = 0; i < values.size(); ++i)
        sum += static_cast<double>(model.weight(layer)[o * values.size() + i]) * values[i];
      next.push_back(layer + 1 < GradientModel::kLayers ? std::max(sum, 0.0) : sum);
    }
    values = std::move(next);
  }
  return {std::tan(values[0]), std::tan(values[1])};
}

/// A frame of a simulated scan, everywhere. Range 0: in double precision; 1: as the program does it.
/// Counters: by how much its slopes differ.
void network_everywhere(benchmark::State& state) {
  const lab::SimulatedFrames& frames = lab::simulated_frames();
  const cv::Mat3b& image = frames.pictures.front();
  GradientMap map(frames.model, frames.background);
  const ColorTable colors = color_table(Light{});
  const cv::Mat1b everywhere = all_blocks(image.size());
  cv::Mat1f gx, gy;
  map.compute(image, colors, everywhere, gx, gy);
  cv::Mat2d exact(image.size());
  for (auto _ : state) {
    if (state.range(0) != 0)
      map.compute(image, colors, everywhere, gx, gy);
    else
      for (int v = 0; v < image.rows; ++v)
        for (int u = 0; u < image.cols; ++u) {
          const cv::Vec3b color = image(v, u);
          exact(v, u) = slopes_in_double(
              frames.model, {color[0] / 255.0, color[1] / 255.0, color[2] / 255.0,
                             static_cast<double>(u) / image.cols, static_cast<double>(v) / image.rows});
        }
    benchmark::DoNotOptimize(gx.data);
    benchmark::DoNotOptimize(exact.data);
  }
  if (state.range(0) != 0) return;
  double squares = 0, largest = 0;
  for (int v = 0; v < image.rows; ++v)
    for (int u = 0; u < image.cols; ++u) {
      const cv::Vec2d background(static_cast<double>(map.background_gx()(v, u)),
                                 static_cast<double>(map.background_gy()(v, u)));
      const cv::Vec2d slopes(static_cast<double>(gx(v, u)), static_cast<double>(gy(v, u)));
      const cv::Vec2d difference = slopes + background - exact(v, u);
      squares += difference.dot(difference) / 2;
      largest = std::max({largest, std::abs(difference[0]), std::abs(difference[1])});
    }
  state.counters["slope_rms"] = std::sqrt(squares / static_cast<double>(image.total()));
  state.counters["slope_max"] = largest;
}

void poisson(benchmark::State& state) {
  PoissonSolver solver(cv::Size(kWidthPx, kHeightPx));
  const cv::Mat1f gx(kHeightPx, kWidthPx, 0.1F), gy(kHeightPx, kWidthPx, -0.1F);
  for (auto _ : state) benchmark::DoNotOptimize(solver.pixels(solver.solve(gx, gy)).data);
}

BENCHMARK(gradient)
    ->Name("surface/gradient")
    ->ArgName("percent_of_pixels")
    ->Arg(25)
    ->Arg(50)
    ->Arg(100)
    ->Unit(benchmark::kMillisecond);
BENCHMARK(network_everywhere)
    ->Name("surface/network_everywhere")
    ->ArgName("program")
    ->Arg(0)
    ->Arg(1)
    ->Unit(benchmark::kMillisecond);
BENCHMARK(poisson)->Name("surface/poisson")->Unit(benchmark::kMillisecond);
}  // namespace
}  // namespace gelslam
