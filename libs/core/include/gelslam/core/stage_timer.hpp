#pragma once

#include <chrono>
#include <cstdint>
#include <map>
#include <mutex>
#include <string>
#include <string_view>
#include <vector>

namespace gelslam {

/// Duration of a stage: count, total and maximum over all samples, median and p99 over the newest samples.
struct StageStatistics {
  std::string stage;
  std::int64_t count = 0;
  double median_ms = 0, p99_ms = 0, max_ms = 0, total_ms = 0;
};

/// Measures the durations of stages on the monotonic clock. It is always active, as a sample takes about a
/// tenth of a microsecond, and the memory is bounded by the number of stages. Thread-safe.
class StageTimer {
 public:
  /// Samples per stage for the median: the newest 164 s at 25 Hz.
  static constexpr std::size_t kKeptSamples = 4096;

  /// Adds the time between its construction and destruction.
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
  /// Returns the statistics in the order in which the stages first occurred. Percentiles are nearest-rank, so
  /// they are times that occurred.
  std::vector<StageStatistics> statistics() const;

 private:
  struct Stage {
    std::size_t order = 0;
    std::int64_t count = 0;
    double max_ms = 0, total_ms = 0;
    std::vector<float> newest_ms;  // A ring buffer once it contains kKeptSamples.
  };
  mutable std::mutex mutex_;
  std::map<std::string, Stage, std::less<>> stages_;
};

}  // namespace gelslam
