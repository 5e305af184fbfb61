#pragma once

#include <chrono>
#include <deque>
#include <mutex>
#include <optional>
#include <string>
#include <vector>

#include "gelslam/core/progress.hpp"
#include "gelslam/slam/live_slam.hpp"
#include "gelslam/slam/slam_map.hpp"

namespace gelslam::slam::detail {

using LiveClock = std::chrono::steady_clock;

/// Rate and latency over the last seconds.
class LiveMeter {
 public:
  void arrived(LiveClock::time_point when);
  void posed(LiveClock::time_point when, double latency_ms);
  /// Of the source as it is `now`: falls when nothing comes any more.
  double rate_hz(LiveClock::time_point now) const;
  double latency_ms(double quantile) const;

 private:
  std::deque<LiveClock::time_point> arrivals_;
  std::deque<std::pair<LiveClock::time_point, double>> latencies_ms_;
};

/// How many trials or components a map has.
int count_different(const MapSnapshot& map, int MapSnapshot::Node::*member);

/// Where the stages pin what they know, and the window reads it. Thread-safe; nobody waits longer than for a
/// copy.
class LiveBoard {
 public:
  explicit LiveBoard(std::string source_description);

  // The stages.
  void set_phase(LivePhase phase);
  LivePhase phase() const;
  void set_state(std::string state);  ///< before anything is tracked, and at the end
  void set_progress(std::int64_t done, std::int64_t total, double elapsed_s);  ///< of this state
  void warn(const std::string& sentence) { warn_about(sentence, sentence); }   ///< once
  /// What is said anew as it changes ("3 frames came damaged"): the newest sentence about it takes the place
  /// of the last.
  void warn_about(const std::string& what, const std::string& sentence);
  void frame_arrived(LiveClock::time_point when, std::int64_t lost_by_camera);
  void source_ended();  ///< the rate stays what it was
  void count(std::int64_t LiveStatus::*frames, std::int64_t more) {
    const std::lock_guard lock(mutex_);
    status_.*frames += more;
  }
  void set_log_bytes(std::int64_t bytes);
  void set_touch(FrameReport touch, LiveClock::time_point captured);
  void set_map(std::shared_ptr<const MapSnapshot> map);
  /// In place of what was good enough while it grew: what was saved.
  void show_saved(const SlamMap& map);

  // The window.
  LiveStatus status() const;
  std::shared_ptr<const FrameReport> touch() const;
  std::shared_ptr<const MapSnapshot> map() const;

 private:
  struct Warning {
    std::string about, sentence;
  };

  bool joined() const;
  void describe_touch(LiveStatus& status) const;

  mutable std::mutex mutex_;
  const LiveClock::time_point start_ = LiveClock::now();
  std::optional<LiveClock::time_point> source_end_, end_;
  LiveStatus status_;  // without its warnings
  std::vector<Warning> warnings_;
  LiveMeter meter_;
  std::shared_ptr<const FrameReport> touch_;
  std::string why_lost_;
  std::shared_ptr<const MapSnapshot> map_ = std::make_shared<MapSnapshot>();
};

/// Puts on the board what is done while finishing, and how far it is.
class BoardProgress final : public ProgressSink {
 public:
  explicit BoardProgress(LiveBoard& board) : board_(board) {}
  void begin(std::string_view task, std::optional<std::int64_t> total) override;
  void update(std::int64_t done) override;
  void end() override {}

 private:
  LiveBoard& board_;
  LiveClock::time_point start_;
  std::int64_t total_ = 0;
};

}  // namespace gelslam::slam::detail
