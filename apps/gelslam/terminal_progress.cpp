#include "terminal_progress.hpp"

#include <fmt/core.h>
#include <sys/ioctl.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <cstdlib>
#include <iostream>

#include "gelslam/core/error.hpp"
#include "gelslam/core/text.hpp"

namespace gelslam {
namespace {

constexpr int kBarCells = 24;
constexpr double kRedrawPeriodS = 0.1;

std::string rate_text(double rate_hz) { return fmt::format("{:.{}f}/s", rate_hz, rate_hz < 10.0 ? 1 : 0); }

std::string bar(double share) {
  const int full = static_cast<int>(share * kBarCells);
  return "[" + std::string(static_cast<std::size_t>(full), '#') +
         std::string(static_cast<std::size_t>(kBarCells - full), '.') + "]";
}

int terminal_columns() {
  winsize size{};
  return ::ioctl(STDERR_FILENO, TIOCGWINSZ, &size) == 0 && size.ws_col > 0 ? size.ws_col : 80;
}

}  // namespace

std::string progress_line(std::string_view task, std::int64_t done, std::optional<std::int64_t> total,
                          double elapsed_s, int columns) {
  std::string line(task);
  line += "  ";
  const double rate_hz = elapsed_s > 0.0 ? static_cast<double>(done) / elapsed_s : 0.0;
  if (total && *total > 0) {
    // The header of a video may announce fewer frames than there are.
    const double share = std::clamp(static_cast<double>(done) / static_cast<double>(*total), 0.0, 1.0);
    line += bar(share) + "  " + std::to_string(static_cast<int>(100.0 * share)) + "%  ";
    line += std::to_string(done) + "/" + std::to_string(*total);
    if (done == 0 && elapsed_s >= 1.0) line += "  " + duration_text(elapsed_s);
  } else if (done > 0 || total) {
    line += std::to_string(done);
  } else {
    line += duration_text(elapsed_s);
  }
  if (rate_hz > 0.0) {
    if (rate_hz >= 0.05) line += "  " + rate_text(rate_hz);
    if (total && done < *total)
      line += "  " + duration_text(static_cast<double>(*total - done) / rate_hz) + " left";
  }
  return line.substr(0, static_cast<std::size_t>(std::max(columns, 1)));
}

TerminalProgress::TerminalProgress(std::ostream& out, int columns, std::function<double()> now_s, bool ticks)
    : out_(out), columns_(columns), now_s_(std::move(now_s)) {
  if (!ticks) return;
  ticker_ = std::jthread([this](const std::stop_token& done) {
    while (!done.stop_requested()) {
      std::this_thread::sleep_for(std::chrono::milliseconds(50));
      const std::lock_guard lock(mutex_);
      if (running_ && now_s_() - drawn_s_ >= 1.0) draw();
    }
  });
}

TerminalProgress::~TerminalProgress() { end(); }

void TerminalProgress::begin(std::string_view task, std::optional<std::int64_t> total) {
  end();
  const std::lock_guard lock(mutex_);
  task_ = task;
  total_ = total;
  done_ = 0;
  start_s_ = now_s_();
  running_ = true;
  draw();
}

void TerminalProgress::update(std::int64_t done) {
  const std::lock_guard lock(mutex_);
  done_ = done;
  if (running_ && now_s_() - drawn_s_ >= kRedrawPeriodS) draw();
}

void TerminalProgress::end() {
  const std::lock_guard lock(mutex_);
  if (!running_) return;
  draw();
  running_ = false;
  out_ << "\n" << std::flush;
}

void TerminalProgress::draw() {
  drawn_s_ = now_s_();
  // One column is left free, because a full line would wrap. "Erase to the end" removes the rest of a longer
  // line. It is written in one call, as other threads may write to the terminal, too.
  out_ << "\r" + progress_line(task_, done_, total_, drawn_s_ - start_s_, columns_ - 1) + "\x1b[K"
       << std::flush;
}

void add_quiet_flag(CLI::App& command, bool& quiet) {
  command.add_flag("-q,--quiet", quiet,
                   "Print no progress and no summary, only results, warnings and errors");
}

std::string amber(const std::string& words, int output) {
  if (words.empty() || ::isatty(output) == 0 || std::getenv("NO_COLOR") != nullptr) return words;
  return "\x1b[33m" + words + "\x1b[0m";
}

std::unique_ptr<ProgressSink> make_progress(bool quiet) {
  if (quiet || ::isatty(STDERR_FILENO) == 0) return std::make_unique<NoProgress>();
  const auto now_s = [] {
    return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count();
  };
  return std::make_unique<TerminalProgress>(std::cerr, terminal_columns(), now_s, /*ticks=*/true);
}

StoppableProgress::StoppableProgress(bool quiet, std::function<void()> stop)
    : stop_(std::move(stop)), shown_(make_progress(quiet)) {}

void StoppableProgress::stop_if_asked() {
  if (!interrupt_.requested()) return;
  if (stop_) stop_();
  throw Error("stopped; nothing was written");
}

void StoppableProgress::begin(std::string_view task, std::optional<std::int64_t> total) {
  stop_if_asked();
  shown_->begin(task, total);
}

void StoppableProgress::update(std::int64_t done) {
  stop_if_asked();
  shown_->update(done);
}

void StoppableProgress::end() { shown_->end(); }

}  // namespace gelslam
