#include "gelslam/core/stage_timer.hpp"

#include <algorithm>
#include <cmath>

namespace gelslam {
namespace {

/// Smallest sample that at least `share` of all samples do not exceed.
double nearest_rank(std::vector<float>& samples, double share) {
  const auto rank = static_cast<std::size_t>(std::ceil(share * static_cast<double>(samples.size())));
  const auto at = samples.begin() + static_cast<std::ptrdiff_t>(std::max<std::size_t>(rank, 1) - 1);
  std::nth_element(samples.begin(), at, samples.end());
  return *at;
}

}  // namespace

void StageTimer::add(std::string_view stage, double duration_ms) {
  const std::lock_guard lock(mutex_);
  auto found = stages_.find(stage);
  if (found == stages_.end()) {
    found = stages_.emplace(std::string(stage), Stage{}).first;
    found->second.order = stages_.size() - 1;
  }
  Stage& times = found->second;
  const auto sample = static_cast<float>(duration_ms);
  if (times.newest_ms.size() < kKeptSamples) {
    times.newest_ms.push_back(sample);
  } else {
    times.newest_ms[static_cast<std::size_t>(times.count) % kKeptSamples] = sample;
  }
  ++times.count;
  times.max_ms = std::max(times.max_ms, duration_ms);
  times.total_ms += duration_ms;
}

std::vector<StageStatistics> StageTimer::statistics() const {
  const std::lock_guard lock(mutex_);
  std::vector<StageStatistics> result(stages_.size());
  for (const auto& [name, times] : stages_) {
    std::vector<float> samples = times.newest_ms;
    result[times.order] = {
        name,         times.count,   nearest_rank(samples, 0.5), nearest_rank(samples, 0.95),
        times.max_ms, times.total_ms};
  }
  return result;
}

}  // namespace gelslam
