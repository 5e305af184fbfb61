#pragma once

#include <array>
#include <functional>
#include <string>
#include <vector>

#include "protocols/protocol.hpp"
#include "protocols/trials.hpp"

namespace gelslam {

/// One method on one trial.
struct BenchmarkRecord {
  std::string method, object, trial;
  std::vector<FrameEstimate> frames;
};

/// By trial, then by method; those without any frame are left out.
using BenchmarkResult = std::vector<BenchmarkRecord>;

struct BenchmarkRequest {
  std::vector<BenchmarkTrial> trials;
  Protocol protocol = Protocol::frame0;
  std::vector<std::string> methods;
  int every = 1;  ///< methods see every so-manieth frame of a trial, the first included
  /// Makes a method, judged by the limits of the trial's configuration.
  std::function<Registrar(const std::string& method, const NormalFlowOptions& limits)> make;
};

/// Every method sees the same frames of every trial.
BenchmarkResult run_benchmark(const BenchmarkRequest& request);

/// x y z in mm, then the rotations about x y z in degrees (zxy Euler angles).
using SixAxes = std::array<double, 6>;

/// Estimate minus truth, angles wrapped to +-180 degrees. Source: Huang et al., RA-L 2024, §V.
SixAxes axis_error(const FrameEstimate& estimate);

/// How well and how fast a method was over some frames.
struct AccuracyRow {
  std::string method, object;  ///< "all" where it is over several
  int trials = 0, frames = 0, tracked = 0;
  SixAxes mae{};                       ///< mean absolute error
  double geometric_mean_mm = 0;        ///< of the six, a degree counted as kMillimetersPerDegree
  double final_mm = 0, final_deg = 0;  ///< at the last frame of each trial, mean over trials
  double median_ms = 0, p95_ms = 0;

  double tracked_share() const { return frames == 0 ? 0.0 : static_cast<double>(tracked) / frames; }
};

/// Rows by object (then over all), methods in the order in which they ran.
std::vector<AccuracyRow> accuracy_by_object(const BenchmarkResult& result);

}  // namespace gelslam
