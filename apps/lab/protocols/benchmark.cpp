#include "protocols/benchmark.hpp"

#include "studies/study.hpp"

namespace gelslam {
namespace {

std::vector<MethodRun> start_methods(const BenchmarkRequest& request, const SlamOptions& options) {
  std::vector<MethodRun> runs;
  runs.reserve(request.methods.size());
  for (const std::string& method : request.methods)
    runs.emplace_back(request.make(method, options.registration), request.protocol, options);
  return runs;
}

}  // namespace

BenchmarkResult run_benchmark(const BenchmarkRequest& request) {
  BenchmarkResult result;
  lab::StudyCases cases(request.trials.size());
  for (const BenchmarkTrial& trial : request.trials) {
    cases.begin(trial.name);
    const std::unique_ptr<TrialFrames> frames = open_trial(trial.folder);
    std::vector<MethodRun> runs = start_methods(request, frames->config().slam);
    for (int read = 0; const std::optional<TrialFrame> frame = frames->next(); ++read)
      if (read % request.every == 0)
        for (MethodRun& run : runs) run.add(*frame);
    for (std::size_t i = 0; i < runs.size(); ++i)
      if (!runs[i].estimates().empty())
        result.push_back({request.methods[i], trial.object, trial.name, runs[i].estimates()});
  }
  return result;
}

}  // namespace gelslam
