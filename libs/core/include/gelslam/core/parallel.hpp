#pragma once

#include <algorithm>
#include <atomic>
#include <cstddef>
#include <exception>
#include <mutex>
#include <thread>
#include <vector>

namespace gelslam {

/// Calls work(i) for i in [0, count) on `threads` threads (0: all cores). Each call must write only its own
/// results, so that they do not depend on the number of threads. The first exception is rethrown by this
/// function.
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

/// As parallel_for(), for consecutive ranges of up to `step` indices: work(begin, end). To be used for
/// indices with little work each, or with expensive common preparation.
template <typename Work>
void parallel_for_ranges(std::size_t count, std::size_t step, int threads, Work&& work) {
  parallel_for((count + step - 1) / step, threads,
               [&](std::size_t i) { work(i * step, std::min((i + 1) * step, count)); });
}

}  // namespace gelslam
