// Cost of searching one keyframe among many: the vote over all of them, and the comparison with one. A whole
// search is one vote and at most max_candidates comparisons, whatever the length of the scan.
#include <benchmark/benchmark.h>

#include <algorithm>
#include <random>

#include "place_features.hpp"
#include "place_index.hpp"

namespace {

using namespace gelslam;
using namespace gelslam::loop_closure::detail;

constexpr int kFeatures = 240;  // what the recorded sequences have

// Descriptors as unevenly spread as real ones: each a noisy copy of one of a thousand kinds.
PlaceFeatures make_features(std::uint64_t seed) {
  std::mt19937_64 random(seed);
  PlaceFeatures features;
  for (int i = 0; i < kFeatures; ++i) {
    features.pixels.emplace_back(static_cast<float>(random() % 320), static_cast<float>(random() % 240));
    std::mt19937_64 kind(random() % 1000);
    for (int k = 0; k < kDescriptorSize; ++k) {
      const int level = static_cast<int>(kind() % 100) + static_cast<int>(random() % 61) - 30;
      features.descriptors.push_back(static_cast<std::uint8_t>(std::max(0, level)));
    }
  }
  return features;
}

void vote_among_keyframes(benchmark::State& state) {
  PlaceIndex index;
  const int keyframes = static_cast<int>(state.range(0));
  for (int i = 0; i < keyframes; ++i) index.add(make_features(static_cast<std::uint64_t>(i)));
  const PlaceFeatures query = make_features(1234567);
  for (auto _ : state) benchmark::DoNotOptimize(index.most_alike(query, keyframes, 20));
}

void compare_with_one_keyframe(benchmark::State& state) {
  const PlaceFeatures a = make_features(1), b = make_features(2);
  for (auto _ : state) {
    const std::vector<Match> matches = match_features(a, b, 0.9);
    benchmark::DoNotOptimize(rigid_inliers(a, b, matches, 3.0, 100));
  }
}

BENCHMARK(vote_among_keyframes)
    ->Name("loop_closure/vote_among_keyframes")
    ->Arg(100)
    ->Arg(700)
    ->Arg(5000)
    ->Unit(benchmark::kMillisecond);
BENCHMARK(compare_with_one_keyframe)
    ->Name("loop_closure/compare_with_one_keyframe")
    ->Unit(benchmark::kMillisecond);

}  // namespace
