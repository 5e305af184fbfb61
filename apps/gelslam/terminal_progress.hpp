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

/// "tracking  [#####.....]  50%  120/240  31.2/s  4 s left"; without a known total "tracking  120  31.2/s",
/// and before anything is counted the time: "closing loops  12 s". Cut to `columns` characters.
std::string progress_line(std::string_view task, std::int64_t done, std::optional<std::int64_t> total,
                          double elapsed_s, int columns);

/// A line on the terminal that is drawn over ten times a second, and stays when its task ends.
class TerminalProgress final : public ProgressSink {
 public:
  /// `now_s` is a monotonic clock. `out` must outlive this. With `ticks` the line is also drawn once a second
  /// while the work says nothing, so that the elapsed time goes on.
  TerminalProgress(std::ostream& out, int columns, std::function<double()> now_s, bool ticks = false);
  ~TerminalProgress() override;
  void begin(std::string_view task, std::optional<std::int64_t> total) override;
  void update(std::int64_t done) override;
  /// Draws the last state and ends the line, so that what is printed next stands on its own.
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
  std::jthread ticker_;  ///< the last member: it ends before the others go
};

/// The one meaning of -q, in all commands and in the laboratory.
void add_quiet_flag(CLI::App& command, bool& quiet);

/// `words` in amber where `output` (1, 2) is a terminal and NO_COLOR is not set: the result lacks something.
std::string amber(const std::string& words, int output);

/// Progress on stderr; nothing when it is no terminal or the person asked for quiet.
std::unique_ptr<ProgressSink> make_progress(bool quiet);

/// The same, and ends the work at Ctrl-C: begin() or update() then calls `stop`, which throws, or without it
/// throws Error "stopped; nothing was written". What is half-written is taken away on the way out.
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
