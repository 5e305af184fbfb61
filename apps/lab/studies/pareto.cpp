#include <algorithm>
#include <cmath>
#include <random>

#include "gelslam/core/median.hpp"
#include "gelslam/evaluation/trajectory_metrics.hpp"
#include "speed_accuracy.hpp"

namespace gelslam::lab {
namespace {

constexpr int kDraws = 400;
// Ratios below which two settings count as different.
constexpr double kSameTime = 0.98, kSameError = 0.998;
constexpr double kMinError = 1e-9;  // For an exact result, whose logarithm would not be finite.

/// How often each reference of each sequence counts in a bootstrap draw.
using Draw = std::vector<std::vector<int>>;

Draw every_reference_once(const GroupedErrors& errors) {
  Draw draw;
  for (const auto& sequence : errors) draw.emplace_back(sequence.size(), 1);
  return draw;
}

std::vector<Draw> draws_of(const GroupedErrors& errors) {
  std::mt19937_64 random(1);
  std::vector<Draw> draws(kDraws);
  for (Draw& draw : draws)
    for (const auto& sequence : errors) {
      draw.emplace_back(sequence.size(), 0);
      for (std::size_t k = 0; k < sequence.size(); ++k) ++draw.back()[random() % sequence.size()];
    }
  return draws;
}

/// Returns the logarithm of the geometric mean of the six mean errors. A reference for which `where` has no
/// errors does not count.
double log_error(const std::vector<std::vector<Vector6d>>& references,
                 const std::vector<std::vector<Vector6d>>& where, const std::vector<int>& times) {
  Vector6d sum = Vector6d::Zero();
  double count = 0;
  for (std::size_t k = 0; k < references.size(); ++k) {
    if (where[k].empty()) continue;
    for (const Vector6d& error : references[k]) sum += times[k] * error;
    count += times[k] * static_cast<double>(references[k].size());
  }
  if (count == 0) return NAN;  // A draw that contains no reference of a slow setting.
  double log_sum = 0;
  for (int axis = 0; axis < 6; ++axis)
    log_sum += std::log(std::max(kMinError, sum[axis] / count) * (axis < 3 ? 1.0 : kMillimetersPerDegree));
  return log_sum / 6;
}

/// Returns the mean of `of` over the sequences for which it is a number.
template <class Of>
double mean_over_sequences(std::size_t sequences, const Of& of) {
  double sum = 0;
  int count = 0;
  for (std::size_t k = 0; k < sequences; ++k)
    if (const double value = of(k); std::isfinite(value)) {
      sum += value;
      ++count;
    }
  return count == 0 ? 0.0 : sum / count;
}

double relative_error(const GroupedErrors& mine, const GroupedErrors& base, const Draw& draw) {
  return std::exp(mean_over_sequences(mine.size(), [&](std::size_t k) {
    return log_error(mine[k], mine[k], draw[k]) - log_error(base[k], mine[k], draw[k]);
  }));
}

double error_of(const GroupedErrors& errors) {
  const Draw all = every_reference_once(errors);
  return std::exp(mean_over_sequences(
      errors.size(), [&](std::size_t k) { return log_error(errors[k], errors[k], all[k]); }));
}

}  // namespace

std::vector<ParetoStanding> pareto_standings(const std::vector<ParetoCandidate>& candidates,
                                             std::size_t base) {
  const GroupedErrors& base_errors = candidates[base].errors;
  const Draw all = every_reference_once(base_errors);
  const std::vector<Draw> draws = draws_of(base_errors);
  std::vector<ParetoStanding> standings(candidates.size());
  for (std::size_t i = 0; i < candidates.size(); ++i) {
    std::vector<double> drawn;
    for (const Draw& draw : draws) drawn.push_back(relative_error(candidates[i].errors, base_errors, draw));
    standings[i].error_mm = error_of(candidates[i].errors);
    standings[i].relative = relative_error(candidates[i].errors, base_errors, all);
    standings[i].relative_low = quantile(drawn, 0.05);
    standings[i].relative_high = quantile(drawn, 0.95);
  }
  for (std::size_t i = 0; i < candidates.size(); ++i) {
    standings[i].on_front = true;
    for (std::size_t k = 0; k < candidates.size(); ++k) {
      const double ms = candidates[i].time_ms, other_ms = candidates[k].time_ms;
      const double error = standings[i].relative, other_error = standings[k].relative;
      if (other_ms <= ms && other_error <= error &&
          (other_ms < kSameTime * ms || other_error < kSameError * error))
        standings[i].on_front = false;
    }
  }
  return standings;
}

}  // namespace gelslam::lab
