#include "protocols/benchmark.hpp"

#include <cstdint>

namespace gelslam {
namespace {

std::int64_t frames_in(const std::vector<BenchmarkTrial>& trials) {
  std::int64_t sum = 0;
  for (const BenchmarkTrial& trial : trials) sum += trial.frames;
  return sum;
}

std::vector<MethodRun> start_methods(const BenchmarkRequest& request, const SlamOptions& options) {
  std::vector<MethodRun> runs;
  runs.reserve(request.methods.size());
  for (const std::string& method : request.methods)
    runs.emplace_back(request.make(method, options.registration), request.protocol, options);
  return runs;
}

}  // namespace

BenchmarkResult run_benchmark(const BenchmarkRequest& request, ProgressSink& progress,
                              const std::function<bool()>& stop) {
  BenchmarkResult result;
  progress.begin("registering", frames_in(request.trials));
  std::int64_t done = 0, trial_start = 0;
  for (const BenchmarkTrial& trial : request.trials) {
    if (result.partial) break;
    TrialFrames frames(trial, request.sources);
    std::vector<MethodRun> runs = start_methods(request, frames.config().slam);
    for (int read = 0; const std::optional<TrialFrame> frame = frames.next(); ++read) {
      if (stop()) {
        result.partial = true;
        break;
      }
      if (read % request.every == 0)
        for (MethodRun& run : runs) run.add(*frame);
      progress.update(++done);
    }
    done = trial_start += trial.frames;  // a video may be shorter than its truth
    for (std::size_t i = 0; i < runs.size(); ++i)
      if (!runs[i].estimates().empty())
        result.records.push_back({request.methods[i], trial.object, trial.name, runs[i].estimates()});
  }
  progress.end();
  return result;
}

}  // namespace gelslam
