// Time of each stage for one frame of a scan, on one thread. All stages together must take less than 40 ms.

#include <benchmark/benchmark.h>

#include <cmath>

#include "gelslam/frontend/tracker.hpp"
#include "gelslam/surface/surface_estimator.hpp"
#include "studies/simulated_frames.hpp"

namespace gelslam {
namespace {

/// Runs through the frames forward and backward, so that any number of steps is one uninterrupted scan. The
/// motion slows down where it turns back, as that of a hand does, because the tracker expects it to continue.
class ToAndFro {
 public:
  explicit ToAndFro(std::size_t count) : last_(static_cast<double>(count - 1)) {}
  std::size_t next() {
    constexpr double kMax = 8;  // Frames per step; 8 frames are 0.1 mm.
    const double phase = 2 * kMax / last_ * step_++;
    return static_cast<std::size_t>(std::lround(0.5 * last_ * (1 - std::cos(phase))));
  }

 private:
  double last_, step_ = 0;
};

void surface_estimate(benchmark::State& state) {
  const lab::SimulatedFrames& frames = lab::simulated_frames();
  SurfaceEstimator estimator(frames.model, frames.background, SurfaceOptions{});
  ToAndFro order(frames.pictures.size());
  for (auto _ : state) benchmark::DoNotOptimize(estimator.estimate(frames.pictures[order.next()]).get());
}

void tracker_step(benchmark::State& state) {
  const lab::SimulatedFrames& frames = lab::simulated_frames();
  Tracker tracker(TrackerOptions{});
  ToAndFro order(frames.surfaces.size());
  std::int64_t frame = 0, lost = 0;
  for (auto _ : state) {
    const TrackedFrame tracked =
        tracker.track(frame, 0.04 * static_cast<double>(frame), frames.surfaces[order.next()]);
    lost += tracked.status == TrackStatus::tracked ? 0 : 1;
    ++frame;
  }
  if (lost > 0) state.SkipWithError("tracking was lost");
}

void frame_from_picture_to_pose(benchmark::State& state) {
  const lab::SimulatedFrames& frames = lab::simulated_frames();
  SurfaceEstimator estimator(frames.model, frames.background, SurfaceOptions{});
  Tracker tracker(TrackerOptions{});
  ToAndFro order(frames.pictures.size());
  std::int64_t frame = 0;
  for (auto _ : state) {
    const TrackedFrame tracked = tracker.track(frame, 0.04 * static_cast<double>(frame),
                                               estimator.estimate(frames.pictures[order.next()]));
    benchmark::DoNotOptimize(&tracked);
    ++frame;
  }
}

BENCHMARK(surface_estimate)->Name("chain/surface_estimate")->Unit(benchmark::kMillisecond);
BENCHMARK(tracker_step)->Name("chain/tracker_step")->Unit(benchmark::kMillisecond);
BENCHMARK(frame_from_picture_to_pose)
    ->Name("chain/frame_from_picture_to_pose")
    ->Unit(benchmark::kMillisecond);

}  // namespace
}  // namespace gelslam
