#include "live/live_board.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <set>

#include "gelslam/core/median.hpp"
#include "gelslam/core/process.hpp"
#include "gelslam/core/text.hpp"
#include "gelslam/slam/trajectory_uncertainty.hpp"

namespace gelslam::slam::detail {
namespace {

constexpr std::chrono::seconds kMeterWindow{3};

double seconds(LiveClock::duration duration) { return std::chrono::duration<double>(duration).count(); }

}  // namespace

int count_different(const MapSnapshot& map, int MapSnapshot::Node::*member) {
  std::set<int> values;
  for (const MapSnapshot::Node& node : map.nodes) values.insert(node.*member);
  return static_cast<int>(values.size());
}

void LiveMeter::arrived(LiveClock::time_point when) {
  arrivals_.push_back(when);
  while (when - arrivals_.front() > kMeterWindow) arrivals_.pop_front();
}

void LiveMeter::posed(LiveClock::time_point when, double latency_ms) {
  latencies_ms_.emplace_back(when, latency_ms);
  while (when - latencies_ms_.front().first > kMeterWindow) latencies_ms_.pop_front();
}

double LiveMeter::rate_hz(LiveClock::time_point now) const {
  if (arrivals_.size() < 2) return 0.0;
  const double intervals = static_cast<double>(arrivals_.size() - 1);
  const double span_s = seconds(arrivals_.back() - arrivals_.front()),
               since_last_s = seconds(now - arrivals_.back());
  // A frame that is slightly late is probably on its way; after two intervals the source counts as stalled.
  const bool stalled = since_last_s > 2.0 * span_s / intervals;
  return intervals / std::max(1e-6, stalled ? span_s + since_last_s : span_s);
}

double LiveMeter::latency_ms(double quantile) const {
  std::vector<double> values;
  for (const auto& [when, latency_ms] : latencies_ms_) values.push_back(latency_ms);
  return gelslam::quantile(std::move(values), quantile);
}

LiveBoard::LiveBoard(std::string source_description) { status_.source = std::move(source_description); }

void LiveBoard::set_phase(LivePhase phase) {
  const std::lock_guard lock(mutex_);
  status_.phase = phase;
  if (phase == LivePhase::finished) end_ = LiveClock::now();
}

LivePhase LiveBoard::phase() const {
  const std::lock_guard lock(mutex_);
  return status_.phase;
}

void LiveBoard::set_state(std::string state) {
  const std::lock_guard lock(mutex_);
  status_.state = std::move(state);
  status_.track = TrackStatus::background;
  status_.progress.clear();
}

void LiveBoard::set_progress(std::int64_t done, std::int64_t total, double elapsed_s) {
  if (done <= 0 || total <= 0) return;
  const double share = static_cast<double>(done) / static_cast<double>(total);
  const std::string text =
      fmt::format("{:.0f}%, {} left", std::floor(100 * share), duration_text(elapsed_s / share - elapsed_s));
  const std::lock_guard lock(mutex_);
  status_.progress = text;
}

void BoardProgress::begin(std::string_view task, std::optional<std::int64_t> total) {
  board_.set_state(std::string(task));
  total_ = total.value_or(0);
  start_ = LiveClock::now();
}

void BoardProgress::update(std::int64_t done) {
  board_.set_progress(done, total_, seconds(LiveClock::now() - start_));
}

void LiveBoard::warn_about(const std::string& what, const std::string& sentence) {
  if (sentence.empty()) return;
  const std::lock_guard lock(mutex_);
  const auto last = std::find_if(warnings_.begin(), warnings_.end(),
                                 [&](const Warning& warning) { return warning.about == what; });
  if (last == warnings_.end())
    warnings_.push_back({what, sentence});
  else
    last->sentence = sentence;
}

void LiveBoard::frame_arrived(LiveClock::time_point when, std::int64_t lost_by_camera) {
  const std::lock_guard lock(mutex_);
  ++status_.frames;
  status_.lost_by_camera = lost_by_camera;
  meter_.arrived(when);
}

void LiveBoard::source_ended() {
  const std::lock_guard lock(mutex_);
  source_end_ = LiveClock::now();
}

void LiveBoard::set_log_bytes(std::int64_t bytes) {
  const std::lock_guard lock(mutex_);
  status_.log_bytes = bytes;
}

void LiveBoard::set_touch(FrameReport touch, LiveClock::time_point captured) {
  auto newest = std::make_shared<const FrameReport>(std::move(touch));
  const LiveClock::time_point now = LiveClock::now();
  const std::lock_guard lock(mutex_);
  const TrackedFrame& frame = newest->tracked;
  if (!touch_ || touch_->tracked.trial != frame.trial)
    why_lost_ = frame.status == TrackStatus::lost ? describe(frame.registration.status) : "";
  touch_ = std::move(newest);
  meter_.posed(now, 1000.0 * seconds(now - captured));
}

void LiveBoard::set_map(std::shared_ptr<const MapSnapshot> newest) {
  const auto loops = std::ranges::count(newest->edges, EdgeKind::loop, &MapSnapshot::Edge::kind);
  const int trials = count_different(*newest, &MapSnapshot::Node::trial),
            components = count_different(*newest, &MapSnapshot::Node::component);
  const std::lock_guard lock(mutex_);  // Tracking may wait for this mutex.
  map_.swap(newest);                   // The previous map is freed after the mutex is released.
  status_.keyframes = static_cast<int>(map_->nodes.size());
  status_.loops = static_cast<int>(loops);
  status_.trials = trials;
  status_.components = components;
  status_.gradient_scale = map_->gradient_scale;
}

void LiveBoard::show_saved(const SlamMap& saved) {
  auto snapshot = std::make_shared<MapSnapshot>(snapshot_of(saved));
  snapshot->version = map()->version + 1;
  set_map(std::move(snapshot));
}

/// Says whether the current contact belongs to the shown map. A trial that the mapper has not seen yet counts
/// as joined as long as there is no map it could be joined to.
bool LiveBoard::joined() const {
  return touch_->in_map && (map_->shown_component < 0 || touch_->in_map->component == map_->shown_component);
}

void LiveBoard::describe_touch(LiveStatus& status) const {
  status.track = TrackStatus::no_contact;
  status.state = "no contact";
  if (!touch_ || !touch_->has_contact()) return;
  if (joined()) {
    status.track = TrackStatus::tracked;
    status.state = "tracking";
    status.reason = touch_->warning;
    const double drift_mm = 2 * touch_->in_map->map_T_frame.worst_sigma_mm();
    if (drift_mm <= kLargeDriftMm) return;
    append_sentence(status.reason, fmt::format("may be off by {:.1f} mm", drift_mm));
    status.advice = "return to the start";
    return;
  }
  status.track = TrackStatus::lost;
  status.state = why_lost_.empty() ? "not joined to the map" : "lost";
  status.reason = why_lost_;
  status.advice = "touch a place you have seen";
}

LiveStatus LiveBoard::status() const {
  const double memory_mb = resident_memory_mb();
  const std::lock_guard lock(mutex_);
  LiveStatus status = status_;
  for (const Warning& warning : warnings_) status.warnings.push_back(warning.sentence);
  if (50 * status.dropped > status.frames)
    status.warnings.push_back(counted(status.dropped, "frame") +
                              " dropped: this computer is too slow for the camera; reconstruct the recorded "
                              "log: that takes every frame of it");
  if (status.phase == LivePhase::scanning) describe_touch(status);
  status.rate_hz = meter_.rate_hz(source_end_.value_or(LiveClock::now()));
  status.latency_ms = meter_.latency_ms(0.5);
  status.latency_p99_ms = meter_.latency_ms(0.99);
  status.age_s = seconds(end_.value_or(LiveClock::now()) - start_);
  status.memory_mb = memory_mb;
  return status;
}

std::shared_ptr<const FrameReport> LiveBoard::touch() const {
  const std::lock_guard lock(mutex_);
  return touch_;
}

std::shared_ptr<const MapSnapshot> LiveBoard::map() const {
  const std::lock_guard lock(mutex_);
  return map_;
}

}  // namespace gelslam::slam::detail
