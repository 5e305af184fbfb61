#pragma once

#include <atomic>
#include <cstddef>
#include <thread>

#include "gelslam/core/progress.hpp"

namespace gelslam {

/// One task whose steps run on several threads (parallel_for): counts them all, and tells the sink only from
/// the thread that made this object, which works, too.
class ParallelProgress {
 public:
  /// Begins the task. `sink` null: nobody listens.
  ParallelProgress(ProgressSink* sink, std::string_view task, std::size_t total)
      : sink_(sink), total_(static_cast<std::int64_t>(total)) {
    if (sink_ != nullptr) sink_->begin(task, total_);
  }
  ParallelProgress(const ParallelProgress&) = delete;
  ParallelProgress& operator=(const ParallelProgress&) = delete;

  /// From any thread, at most `total` times.
  void step() {
    const std::int64_t done = ++done_;
    if (sink_ != nullptr && std::this_thread::get_id() == thread_) sink_->update(done);
  }
  /// All is done, also where fewer steps were needed.
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
