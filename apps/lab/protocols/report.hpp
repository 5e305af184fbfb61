#pragma once

#include <array>
#include <string>
#include <vector>

#include "protocols/benchmark.hpp"

namespace gelslam {

/// x y z in mm, then the rotations about x y z in degrees (zxy Euler angles).
using SixAxes = std::array<double, 6>;

SixAxes six_axes(const Pose& pose);

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
