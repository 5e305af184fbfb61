#pragma once

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

/// How well and how fast a method was over some frames.
struct AccuracyRow {
  std::string method, object;  ///< "all" where it is over several
  int trials = 0, frames = 0, tracked = 0;
  Vector6d mae = Vector6d::Zero();     ///< mean absolute axis_error()
  double geometric_mean_mm = 0;        ///< of the six, a degree counted as kMillimetersPerDegree
  double final_mm = 0, final_deg = 0;  ///< at the last frame of each trial, mean over trials
  double median_ms = 0, p95_ms = 0;

  double tracked_share() const { return frames == 0 ? 0.0 : static_cast<double>(tracked) / frames; }
};

/// Rows by object (then over all), methods in the order in which they ran.
std::vector<AccuracyRow> accuracy_by_object(const BenchmarkResult& result);

}  // namespace gelslam
