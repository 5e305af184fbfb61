#pragma once

#include <algorithm>
#include <atomic>
#include <cstddef>
#include <exception>
#include <mutex>
#include <thread>
#include <vector>

namespace gelslam::fusion::detail {

/// Calls work(i) for i in [0, count) on `threads` threads (0: all cores). Each i must write only what is its
/// own, so that the result does not depend on the number of threads. The first exception is thrown again
/// here.
template <typename Work>
void parallel_for(std::size_t count, int threads, Work&& work) {
  const std::size_t wanted =
      threads > 0 ? static_cast<std::size_t>(threads) : std::thread::hardware_concurrency();
  const std::size_t n = std::max<std::size_t>(1, std::min(wanted, count));
  std::atomic<std::size_t> next{0};
  std::exception_ptr failure;
  std::mutex failure_mutex;
  const auto run = [&] {
    try {
      for (std::size_t i = next++; i < count; i = next++) work(i);
    } catch (...) {
      const std::lock_guard lock(failure_mutex);
      if (!failure) failure = std::current_exception();
      next = count;
    }
  };
  std::vector<std::jthread> helpers;
  for (std::size_t t = 1; t < n; ++t) helpers.emplace_back(run);
  run();
  helpers.clear();
  if (failure) std::rethrow_exception(failure);
}

}  // namespace gelslam::fusion::detail
