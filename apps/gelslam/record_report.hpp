#pragma once

#include <chrono>
#include <cstdint>
#include <string>

#include "gelslam/sensor/log_recorder.hpp"
#include "gelslam/sensor/raw_frame.hpp"

namespace gelslam {

/// What a recording says to the person at the terminal, on stderr.
class RecordReport {
 public:
  RecordReport(const std::string& log, bool quiet);

  void start(const std::string& source);
  /// A sentence of its own line, also when quiet.
  void say(const std::string& sentence);
  /// For every frame; draws the progress line now and then, and says warnings that are new.
  void count(const RawFrame& frame, std::int64_t lost, const LogRecorderStatus& status);
  void finish(const LogRecorderStatus& status, std::int64_t lost, const std::string& source_warning);
  bool good() const { return good_; }

 private:
  void clear_line();
  double rate_hz() const;

  std::string log_;
  bool quiet_, terminal_, good_ = true, drawn_ = false;
  std::string said_;  // the first warning
  std::int64_t frames_ = 0;
  double first_s_ = 0, last_s_ = 0;
  std::chrono::steady_clock::time_point drawn_at_;
};

}  // namespace gelslam
