#pragma once

#include <functional>
#include <string>
#include <vector>

#include "gelslam/core/progress.hpp"
#include "protocols/protocol.hpp"
#include "protocols/trials.hpp"

namespace gelslam {

/// One method on one trial.
struct BenchmarkRecord {
  std::string method, object, trial;
  std::vector<FrameEstimate> frames;
};

struct BenchmarkResult {
  bool partial = false;                  ///< stopped before the end
  std::vector<BenchmarkRecord> records;  ///< by trial, then by method; those without any frame are left out
};

struct BenchmarkRequest {
  std::vector<BenchmarkTrial> trials;
  TrialSources sources;
  Protocol protocol = Protocol::frame0;
  std::vector<std::string> methods;
  int every = 1;  ///< methods see every so-manieth frame of a trial, the first included
  /// Makes a method, judged by the limits of the trial's configuration.
  std::function<std::shared_ptr<const Registrar>(const std::string& method, const NormalFlowOptions& limits)>
      make;
};

/// Every method sees the same frames of every trial. `stop` is asked before each frame; when it says so, what
/// is done so far is the result.
BenchmarkResult run_benchmark(const BenchmarkRequest& request, ProgressSink& progress,
                              const std::function<bool()>& stop);

}  // namespace gelslam
