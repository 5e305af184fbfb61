#pragma once

#include <chrono>
#include <cstdint>
#include <map>
#include <mutex>
#include <string>
#include <string_view>
#include <vector>

namespace gelslam {

/// How long one stage took: count, total and max over everything, median and p99 over the newest samples.
struct StageStatistics {
  std::string stage;
  std::int64_t count = 0;
  double median_ms = 0, p99_ms = 0, max_ms = 0, total_ms = 0;
};

/// Times per stage on the monotonic clock, always on: about a tenth of a microsecond per sample, memory
/// bounded by the number of stages. Thread-safe.
class StageTimer {
 public:
  static constexpr std::size_t kKeptSamples = 4096;  ///< per stage, for the median: newest 164 s at 25 Hz

  /// Adds the time from its construction to its destruction.
  class Scope {
   public:
    Scope(StageTimer& timer, std::string_view stage) : timer_(timer), stage_(stage), start_(Clock::now()) {}
    ~Scope() { timer_.add(stage_, std::chrono::duration<double, std::milli>(Clock::now() - start_).count()); }
    Scope(const Scope&) = delete;
    Scope& operator=(const Scope&) = delete;

   private:
    using Clock = std::chrono::steady_clock;
    StageTimer& timer_;
    std::string_view stage_;
    Clock::time_point start_;
  };

  /// `stage` must outlive the scope: a string literal.
  [[nodiscard]] Scope measure(std::string_view stage) { return Scope(*this, stage); }
  void add(std::string_view stage, double duration_ms);
  /// In the order in which stages were first seen. Percentiles are nearest-rank: always a time that occurred.
  std::vector<StageStatistics> statistics() const;

 private:
  struct Stage {
    std::size_t order = 0;
    std::int64_t count = 0;
    double max_ms = 0, total_ms = 0;
    std::vector<float> newest_ms;  // a ring once it holds kKeptSamples
  };
  mutable std::mutex mutex_;
  std::map<std::string, Stage, std::less<>> stages_;
};

}  // namespace gelslam
