#include "record_report.hpp"

#include <unistd.h>

#include <algorithm>
#include <cstdio>
#include <iostream>

#include "gelslam/core/text.hpp"

namespace gelslam {
namespace {

std::string printed(const char* format, double number) {
  char text[64];
  std::snprintf(text, sizeof text, format, number);
  return text;
}

std::string size_text(std::int64_t bytes) {
  const double megabytes = static_cast<double>(bytes) / 1e6;
  return megabytes < 1000 ? printed("%.1f MB", megabytes) : printed("%.2f GB", megabytes / 1000);
}

}  // namespace

RecordReport::RecordReport(const std::string& log, bool quiet)
    : log_(log), quiet_(quiet), terminal_(::isatty(STDERR_FILENO) != 0) {}

void RecordReport::start(const std::string& source) {
  if (!quiet_) std::cerr << "recording " << source << " (Ctrl-C ends it)\n";
}

void RecordReport::say(const std::string& sentence) {
  clear_line();
  std::cerr << "gelslam: " << sentence << "\n";
}

void RecordReport::count(const RawFrame& frame, std::int64_t lost, const LogRecorderStatus& status) {
  if (frames_++ == 0) first_s_ = frame.time_s;
  last_s_ = std::max(last_s_, frame.time_s);
  if (!status.warning.empty() && said_.empty()) {
    said_ = status.warning;
    say("warning: " + status.warning);
  }
  const auto now = std::chrono::steady_clock::now();
  if (quiet_ || !terminal_ || now - drawn_at_ < std::chrono::milliseconds(200)) return;
  drawn_at_ = now;
  drawn_ = true;
  std::cerr << "\r" << frames_ << " frames  " << printed("%.1f s", last_s_ - first_s_) << "  "
            << printed("%.1f Hz", rate_hz()) << "  " << lost << " lost  " << size_text(status.bytes)
            << "\x1b[K" << std::flush;
}

void RecordReport::finish(const LogRecorderStatus& status, std::int64_t lost,
                          const std::string& source_warning) {
  clear_line();
  good_ = status.written > 0 && !status.stopped && status.left_out == 0;
  if (!source_warning.empty()) say("warning: " + source_warning);
  if (!status.warning.empty() && status.warning != said_) say("warning: " + status.warning);
  if (status.damaged > 0) say("warning: left out " + counted(status.damaged, "damaged picture"));
  if (status.written == 0) {
    say("nothing was recorded");
    return;
  }
  if (quiet_) return;
  std::cerr << "recorded " << counted(status.written, "frame");
  if (status.written == frames_)  // else the times are not those of what was recorded
    std::cerr << " in " << printed("%.1f s", last_s_ - first_s_) << " (" << printed("%.2f Hz", rate_hz())
              << ")";
  std::cerr << ", " << lost << " lost by the camera, " << size_text(status.bytes) << ": " << log_ << "\n";
}

void RecordReport::clear_line() {
  if (drawn_) std::cerr << "\r\x1b[K";
  drawn_ = false;
}

double RecordReport::rate_hz() const {
  return last_s_ > first_s_ ? static_cast<double>(frames_ - 1) / (last_s_ - first_s_) : 0.0;
}

}  // namespace gelslam
