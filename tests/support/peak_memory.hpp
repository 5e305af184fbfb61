#pragma once

#include <fstream>
#include <string>

namespace gelslam::test {

/// By how many bytes this process's memory grew at most while `work` ran.
template <typename Work>
std::size_t memory_growth(Work&& work) {
  const auto kilobytes = [](const std::string& key) {
    std::ifstream status("/proc/self/status");
    for (std::string word; status >> word;)
      if (std::size_t value = 0; word == key && status >> value) return value;
    return std::size_t{0};
  };
  std::ofstream("/proc/self/clear_refs") << 5;  // the peak is that of now
  const std::size_t before = kilobytes("VmRSS:");
  work();
  const std::size_t peak = kilobytes("VmHWM:");
  return peak > before ? 1024 * (peak - before) : 0;
}

}  // namespace gelslam::test
