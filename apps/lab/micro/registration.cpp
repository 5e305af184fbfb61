// Time of registering one frame to an existing keyframe, and of preparing a keyframe once, on one thread.

#include <benchmark/benchmark.h>

#include "gelslam/registration/normal_flow.hpp"
#include "studies/simulated_frames.hpp"

namespace gelslam {
namespace {

NormalFlowOptions options_with_samples(const benchmark::State& state) {
  NormalFlowOptions options;
  options.max_samples = static_cast<int>(state.range(0));
  return options;
}

/// Frames 0.1 mm apart, starting from the pose of the first one, as in tracking at 25 Hz.
void normal_flow_with_kept_keyframe(benchmark::State& state) {
  const lab::SimulatedFrames& frames = lab::simulated_frames();
  const NormalFlowOptions options = options_with_samples(state);
  const NormalFlowReference reference(frames.surfaces[0], options);
  RegistrationResult result;
  for (auto _ : state) {
    result = register_normal_flow(reference, *frames.surfaces[8], Pose::Identity(), options);
    benchmark::DoNotOptimize(&result);
  }
  if (!result.ok()) state.SkipWithError("the frames do not register");
  state.counters["iterations"] = result.iterations;
  state.counters["samples"] = reference.sample_count();
}

void reference_preparation(benchmark::State& state) {
  const lab::SimulatedFrames& frames = lab::simulated_frames();
  const NormalFlowOptions options = options_with_samples(state);
  for (auto _ : state) {
    const NormalFlowReference reference(frames.surfaces[0], options);
    benchmark::DoNotOptimize(reference.sample_count());
  }
}

BENCHMARK(normal_flow_with_kept_keyframe)
    ->Name("registration/normal_flow_with_kept_keyframe")
    ->ArgName("max_samples")
    ->Arg(1000)
    ->Arg(3000)
    ->Unit(benchmark::kMillisecond);
BENCHMARK(reference_preparation)
    ->Name("registration/reference_preparation")
    ->ArgName("max_samples")
    ->Arg(1000)
    ->Arg(3000)
    ->Unit(benchmark::kMillisecond);

}  // namespace
}  // namespace gelslam
