#pragma once

#include <CLI/CLI.hpp>
#include <functional>
#include <memory>
#include <mutex>
#include <ostream>
#include <string>
#include <thread>

#include "gelslam/core/process.hpp"
#include "gelslam/core/progress.hpp"

namespace gelslam {

/// Returns "tracking  [#####.....]  50%  120/240  31.2/s  4 s left"; without a known total "tracking  120
/// 31.2/s"; and before anything is counted the elapsed time, "closing loops  12 s". It is cut to `columns`
/// characters.
std::string progress_line(std::string_view task, std::int64_t done, std::optional<std::int64_t> total,
                          double elapsed_s, int columns);

/// A line on the terminal that is redrawn ten times a second, and remains when its task ends.
class TerminalProgress final : public ProgressSink {
 public:
  /// `now_s` is a monotonic clock. `out` must outlive this object. With `ticks` the line is also redrawn once
  /// a second while no progress is reported, so that the elapsed time is updated.
  TerminalProgress(std::ostream& out, int columns, std::function<double()> now_s, bool ticks = false);
  ~TerminalProgress() override;
  void begin(std::string_view task, std::optional<std::int64_t> total) override;
  void update(std::int64_t done) override;
  /// Draws the last state and ends the line, so that later output begins on a new line.
  void end() override;

 private:
  void draw();

  std::ostream& out_;
  int columns_;
  std::function<double()> now_s_;
  std::string task_;
  std::optional<std::int64_t> total_;
  std::int64_t done_ = 0;
  double start_s_ = 0.0, drawn_s_ = 0.0;
  bool running_ = false;
  std::mutex mutex_;
  std::jthread ticker_;  ///< The last member, so that its thread ends before the others are destroyed.
};

/// Adds -q, which has the same meaning in all commands and in the laboratory.
void add_quiet_flag(CLI::App& command, bool& quiet);

/// Returns `words` in amber if `output` (1, 2) is a terminal and NO_COLOR is not set; for results that lack
/// something.
std::string amber(const std::string& words, int output);

/// Returns progress on stderr, or none if it is no terminal or the user asked for quiet.
std::unique_ptr<ProgressSink> make_progress(bool quiet);

/// As make_progress(), and ends the work at Ctrl-C: begin() or update() then calls `stop`, which throws, or
/// throws Error "stopped; nothing was written". Incomplete output is removed while the exception passes.
class StoppableProgress final : public ProgressSink {
 public:
  explicit StoppableProgress(bool quiet, std::function<void()> stop = nullptr);
  void begin(std::string_view task, std::optional<std::int64_t> total) override;
  void update(std::int64_t done) override;
  void end() override;

 private:
  void stop_if_asked();

  std::function<void()> stop_;
  InterruptWatch interrupt_;
  std::unique_ptr<ProgressSink> shown_;
};

}  // namespace gelslam
