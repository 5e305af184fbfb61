// Time of each stage from image to surface at 320x240 pixels, on one thread.

#include <benchmark/benchmark.h>

#include <opencv2/core.hpp>

#include "heights/poisson.hpp"
#include "photometry/blocks.hpp"
#include "photometry/light.hpp"
#include "slopes/gradient_map.hpp"
#include "studies/simulated_frames.hpp"

namespace gelslam {
namespace {

using namespace surface::detail;

void gradient(benchmark::State& state) {
  const lab::SimulatedFrames& frames = lab::simulated_frames();
  const cv::Mat3b& image = frames.pictures.front();
  GradientMap map(frames.model, frames.background);
  const ColorTable colors = color_table(Light{});
  cv::Mat1b blocks = all_blocks(image.size());
  blocks.rowRange(blocks.rows * static_cast<int>(state.range(0)) / 100, blocks.rows).setTo(0);
  cv::Mat1f gx, gy;
  for (auto _ : state) {
    map.compute(image, colors, blocks, gx, gy);
    benchmark::DoNotOptimize(gx.data);
  }
}

void poisson(benchmark::State& state) {
  const cv::Size size(320, 240);
  PoissonSolver solver(size);
  const cv::Mat1f gx(size, 0.1F), gy(size, -0.1F);
  for (auto _ : state) benchmark::DoNotOptimize(solver.pixels(solver.solve(gx, gy)).data);
}

BENCHMARK(gradient)
    ->Name("surface/gradient")
    ->ArgName("percent_of_pixels")
    ->Arg(25)
    ->Arg(50)
    ->Arg(100)
    ->Unit(benchmark::kMillisecond);
BENCHMARK(poisson)->Name("surface/poisson")->Unit(benchmark::kMillisecond);

}  // namespace
}  // namespace gelslam
