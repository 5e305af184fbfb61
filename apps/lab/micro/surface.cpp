// Time of each stage from color to surface at the sensor's own 320x240, one thread. The picture is a press
// made from formulas: color follows slope, so the share of changed pixels is what a contact of 9 mm gives
// (about a half).

#include <benchmark/benchmark.h>

#include <cmath>
#include <opencv2/core.hpp>
#include <random>

#include "gelslam/surface/surface_estimator.hpp"
#include "heights/contact_mask.hpp"
#include "heights/poisson.hpp"
#include "photometry/blocks.hpp"
#include "photometry/light.hpp"
#include "slopes/gradient_map.hpp"

namespace gelslam {
namespace {

using namespace surface::detail;

constexpr int width_px = 320, height_px = 240;

GradientModel random_model() {
  GradientModel model;
  std::mt19937_64 random(1);
  for (float& number : model.numbers)
    number = static_cast<float>(static_cast<double>(random() >> 11) * 0x1p-53 * 0.4 - 0.2);
  return model;
}

const cv::Mat3b& background() {
  static const cv::Mat3b image(height_px, width_px, cv::Vec3b(105, 95, 78));
  return image;
}

cv::Mat3b press() {
  cv::Mat3b image(height_px, width_px);
  for (int v = 0; v < height_px; ++v) {
    for (int u = 0; u < width_px; ++u) {
      const double x = (u - 160) / 45.0, y = (v - 120) / 45.0, bell = std::exp(-0.5 * (x * x + y * y));
      image(v, u) = cv::Vec3b(cv::saturate_cast<uchar>(105 + 50 * x * bell),
                              cv::saturate_cast<uchar>(95 + 40 * y * bell),
                              cv::saturate_cast<uchar>(78 - 50 * x * bell));
    }
  }
  return image;
}

cv::Mat3f blocks_of(const cv::Mat3b& image) {
  cv::Mat3f means;
  BlockAverager().average(image, means);
  return means;
}

void change_mask(benchmark::State& state) {
  const cv::Mat3f background_blocks = blocks_of(background());
  const cv::Mat3b image = press();
  BlockAverager averager;
  LightTracker light(background_blocks);
  ChangeDetector detector;
  cv::Mat3f blocks;
  cv::Mat1b changed;
  for (auto _ : state) {
    averager.average(image, blocks);
    to_background_light(light.update(blocks, cv::Mat1b()), blocks);
    cv::subtract(blocks, background_blocks, blocks);
    detector.detect(blocks, changed);
    benchmark::DoNotOptimize(changed.data);
  }
}

void gradient(benchmark::State& state) {
  const cv::Mat3b image = press();
  GradientMap map(random_model(), background());
  const ColorTable colors = color_table(Light{});
  cv::Mat1b where(image.size(), static_cast<uchar>(0));
  where.rowRange(0, height_px * static_cast<int>(state.range(0)) / 100).setTo(255);
  cv::Mat1f gx, gy;
  for (auto _ : state) {
    map.compute(image, colors, where, gx, gy);
    benchmark::DoNotOptimize(gx.data);
  }
}

void poisson(benchmark::State& state) {
  PoissonSolver solver(cv::Size(width_px, height_px));
  const cv::Mat1f gx(height_px, width_px, 0.1F), gy(height_px, width_px, -0.1F);
  for (auto _ : state) benchmark::DoNotOptimize(solver.solve(gx, gy).data);
}

void whole_estimate(benchmark::State& state) {
  const cv::Mat3b image = press();
  SurfaceOptions options;
  options.gradient_everywhere = state.range(0) != 0;
  SurfaceEstimator estimator(random_model(), background(), options);
  SurfaceTimings sum;
  for (auto _ : state) {
    benchmark::DoNotOptimize(estimator.estimate(image).get());
    const SurfaceTimings& timings = estimator.timings();
    sum.gradient_ms += timings.gradient_ms;
    sum.poisson_ms += timings.poisson_ms;
    sum.contact_ms += timings.contact_ms;
    sum.normals_ms += timings.normals_ms;
  }
  const auto mean = benchmark::Counter::kAvgIterations;
  state.counters["gradient_ms"] = benchmark::Counter(sum.gradient_ms, mean);
  state.counters["poisson_ms"] = benchmark::Counter(sum.poisson_ms, mean);
  state.counters["contact_ms"] = benchmark::Counter(sum.contact_ms, mean);
  state.counters["normals_ms"] = benchmark::Counter(sum.normals_ms, mean);
}

BENCHMARK(change_mask)->Name("surface/change_mask")->Unit(benchmark::kMillisecond);
BENCHMARK(gradient)
    ->Name("surface/gradient")
    ->ArgName("percent_of_pixels")
    ->Arg(25)
    ->Arg(50)
    ->Arg(100)
    ->Unit(benchmark::kMillisecond);
BENCHMARK(poisson)->Name("surface/poisson")->Unit(benchmark::kMillisecond);
BENCHMARK(whole_estimate)
    ->Name("surface/whole_estimate")
    ->ArgName("everywhere")
    ->Arg(0)
    ->Arg(1)
    ->Unit(benchmark::kMillisecond);

}  // namespace
}  // namespace gelslam
