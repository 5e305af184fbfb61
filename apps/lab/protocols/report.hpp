#pragma once

#include <array>
#include <filesystem>
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
  std::string method, object, trial;  ///< "all" where it is over several
  int trials = 0, frames = 0, tracked = 0;
  SixAxes mae{};                       ///< mean absolute error
  double geometric_mean_mm = 0;        ///< of the six, a degree counted as kMillimetersPerDegree
  double final_mm = 0, final_deg = 0;  ///< at the last frame of each trial, mean over trials
  double median_ms = 0, p95_ms = 0;

  double tracked_share() const { return frames == 0 ? 0.0 : static_cast<double>(tracked) / frames; }
};

struct RuntimeBin {
  std::string method;
  double low_ms = 0, high_ms = 0;
  int frames = 0;
};

/// Error against time since the first contact, over trials: mean of absolute errors and their standard
/// deviation.
struct ErrorBand {
  std::string method, object;
  int frame = 0;  ///< since the first contact
  int trials = 0;
  SixAxes mean{}, deviation{};
};

/// Rows by object (then over all), methods in the order in which they ran.
std::vector<AccuracyRow> accuracy_by_object(const BenchmarkResult& result);
std::vector<AccuracyRow> accuracy_by_trial(const BenchmarkResult& result);
/// Eight bins per decade; empty ones between the fastest and the slowest frame of a method are there.
std::vector<RuntimeBin> runtime_histogram(const BenchmarkResult& result);
std::vector<ErrorBand> error_bands(const BenchmarkResult& result);

/// The table for people, and one JSON object with all but the single frames.
std::string to_table(const BenchmarkResult& result);
std::string to_json(const BenchmarkResult& result);

/// Writes benchmark.json, accuracy.csv, trials.csv, runtime.csv, error_over_time.csv and frames.csv.
void write_benchmark(const std::filesystem::path& folder, const BenchmarkResult& result);

/// All that write_benchmark writes.
const std::vector<std::string>& benchmark_files();

}  // namespace gelslam
