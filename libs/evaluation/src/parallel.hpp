#pragma once

#include <algorithm>
#include <cstddef>
#include <thread>
#include <vector>

namespace gelslam::evaluation::detail {

/// Calls work(begin, end) for consecutive ranges that cover [0, count), on all cores. Each index must write
/// only what belongs to it; then the result does not depend on the number of threads.
template <typename Work>
void parallel_ranges(std::size_t count, const Work& work) {
  const std::size_t threads = std::clamp<std::size_t>(std::thread::hardware_concurrency(), 1, 64);
  const std::size_t share = (count + threads - 1) / threads;
  std::vector<std::jthread> pool;
  for (std::size_t begin = share; begin < count; begin += share) {
    pool.emplace_back([&work, begin, end = std::min(begin + share, count)] { work(begin, end); });
  }
  work(std::size_t{0}, std::min(share, count));
}

}  // namespace gelslam::evaluation::detail
