#include "gelslam/core/stage_timer.hpp"

#include "gelslam/core/median.hpp"

namespace gelslam {

void StageTimer::add(std::string_view stage, double duration_ms) {
  const std::lock_guard lock(mutex_);
  auto found = stages_.find(stage);
  if (found == stages_.end()) {
    found = stages_.emplace(std::string(stage), Stage{}).first;
    found->second.order = stages_.size() - 1;
  }
  Stage& times = found->second;
  const auto sample = static_cast<float>(duration_ms);
  if (times.newest_ms.size() < kKeptSamples)
    times.newest_ms.push_back(sample);
  else
    times.newest_ms[static_cast<std::size_t>(times.count) % kKeptSamples] = sample;
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
        name,         times.count,   quantile_in_place(samples, 0.5), quantile_in_place(samples, 0.99),
        times.max_ms, times.total_ms};
  }
  return result;
}

}  // namespace gelslam
