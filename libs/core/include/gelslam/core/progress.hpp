#pragma once

#include <atomic>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string_view>
#include <thread>

namespace gelslam {

/// Receives the progress of long work. Library code reports to a sink and never prints; the program chooses
/// the sink. There is one task at a time, reported by one thread.
class ProgressSink {
 public:
  virtual ~ProgressSink() = default;
  /// A task of `total` steps begins (nullopt: unknown). `task` is a noun for the user: "tracking".
  virtual void begin(std::string_view task, std::optional<std::int64_t> total) = 0;
  /// `done` is the total number of steps done. Cheap enough to be called for every frame.
  virtual void update(std::int64_t done) = 0;
  virtual void end() = 0;
};

/// Reports nothing: the default of libraries and tests.
class NoProgress final : public ProgressSink {
 public:
  void begin(std::string_view, std::optional<std::int64_t>) override {}
  void update(std::int64_t) override {}
  void end() override {}
};

/// One task whose steps run on several threads (parallel_for()). It counts the steps of all threads, and
/// calls the sink only in the thread that created this object, which takes part in the work.
class ParallelProgress {
 public:
  /// Begins the task. If `sink` is null, nothing is reported.
  ParallelProgress(ProgressSink* sink, std::string_view task, std::size_t total)
      : sink_(sink), total_(static_cast<std::int64_t>(total)) {
    if (sink_ != nullptr) sink_->begin(task, total_);
  }
  ParallelProgress(const ParallelProgress&) = delete;
  ParallelProgress& operator=(const ParallelProgress&) = delete;

  /// To be called from any thread, at most `total` times.
  void step() {
    const std::int64_t done = ++done_;
    if (sink_ != nullptr && std::this_thread::get_id() == thread_) sink_->update(done);
  }
  /// Reports that all is done, even if fewer steps were needed.
  void end() {
    if (sink_ == nullptr) return;
    sink_->update(total_);
    sink_->end();
  }

 private:
  ProgressSink* const sink_;
  const std::int64_t total_;
  const std::thread::id thread_ = std::this_thread::get_id();
  std::atomic<std::int64_t> done_{0};
};

}  // namespace gelslam
