#pragma once

#include <string>
#include <vector>

#include "protocols/protocol.hpp"
#include "protocols/trials.hpp"

namespace gelslam {

/// Results of one method on one trial.
struct BenchmarkRecord {
  std::string method, object, trial;
  std::vector<FrameEstimate> frames;
};

/// Ordered by trial, then by method. Entries without any frame are left out.
using BenchmarkResult = std::vector<BenchmarkRecord>;

/// Accuracy and time of a method over some frames.
struct AccuracyRow {
  std::string method, object;  ///< "all" for the mean over several objects.
  int trials = 0, frames = 0, tracked = 0;
  Vector6d mae = Vector6d::Zero();  ///< Mean absolute axis_error().
  double geometric_mean_mm = 0;     ///< Geometric mean of the six; a degree counts as kMillimetersPerDegree.
  double final_mm = 0, final_deg = 0;  ///< Error at the last frame of each trial, mean over trials.
  double median_ms = 0, p95_ms = 0;

  double tracked_share() const { return frames == 0 ? 0.0 : static_cast<double>(tracked) / frames; }
};

/// Returns rows by object, then over all objects; methods are in the order in which they ran.
std::vector<AccuracyRow> accuracy_by_object(const BenchmarkResult& result);

}  // namespace gelslam
