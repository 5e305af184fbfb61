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

/// Frame rate and latency over the last seconds.
class LiveMeter {
 public:
  void arrived(LiveClock::time_point when);
  void posed(LiveClock::time_point when, double latency_ms);
  /// Rate of the source at the time `now`. It decreases when no more frames arrive.
  double rate_hz(LiveClock::time_point now) const;
  double latency_ms(double quantile) const;

 private:
  std::deque<LiveClock::time_point> arrivals_;
  std::deque<std::pair<LiveClock::time_point, double>> latencies_ms_;
};

/// Returns the number of different trials or components in a map.
int count_different(const MapSnapshot& map, int MapSnapshot::Node::*member);

/// State that the stages of a live scan publish and the window reads. Thread-safe; no caller waits for longer
/// than a copy takes.
class LiveBoard {
 public:
  explicit LiveBoard(std::string source_description);

  // For the stages:
  void set_phase(LivePhase phase);
  LivePhase phase() const;
  void set_state(std::string state);  ///< Sets the state before tracking begins and while finishing.
  /// Progress of the current state.
  void set_progress(std::int64_t done, std::int64_t total, double elapsed_s);
  /// Each sentence is added once.
  void warn(const std::string& sentence) { warn_about(sentence, sentence); }
  /// Adds a warning that changes over time ("3 frames came damaged"): a new sentence about `what` replaces
  /// the previous one.
  void warn_about(const std::string& what, const std::string& sentence);
  void frame_arrived(LiveClock::time_point when, std::int64_t lost_by_camera);
  void source_ended();  ///< Freezes the frame rate.
  void count(std::int64_t LiveStatus::*frames, std::int64_t more) {
    const std::lock_guard lock(mutex_);
    status_.*frames += more;
  }
  void set_log_bytes(std::int64_t bytes);
  void set_touch(FrameReport touch, LiveClock::time_point captured);
  void set_map(std::shared_ptr<const MapSnapshot> map);
  /// Replaces the preliminary map of the running scan by the saved one.
  void show_saved(const SlamMap& map);

  // For the window:
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

/// Publishes the current task of finishing and its progress.
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
