#include <algorithm>
#include <atomic>
#include <exception>
#include <limits>
#include <thread>

#include "gelslam/sensor/log_recorder.hpp"

namespace gelslam {
namespace {

double seconds_of(std::chrono::steady_clock::time_point time) {
  return std::chrono::duration<double>(time.time_since_epoch()).count();
}

/// The time of the first frame that any of the sources gives.
using CommonStart = std::atomic<double>;
constexpr double kNotStarted = -1;

class SourceOnOneClock final : public RawFrameSource {
 public:
  SourceOnOneClock(std::unique_ptr<RawFrameSource> source, std::shared_ptr<CommonStart> start)
      : source_(std::move(source)), start_(std::move(start)) {}

  std::optional<RawFrame> next() override {
    while (std::optional<RawFrame> frame = source_->next()) {
      if (++seen_ <= kFirstFrames) {
        begin_s_ = std::min(begin_s_, seconds_of(frame->arrived) - frame->time_s);
        lost_before_ = source_->lost_frames();
        continue;
      }
      const double time_s = begin_s_ + frame->time_s;
      double start_s = kNotStarted;
      if (start_->compare_exchange_strong(start_s, time_s)) start_s = time_s;
      if (time_s < start_s) continue;
      frame->time_s = time_s - start_s;
      frame->index = index_++;
      return frame;
    }
    return std::nullopt;
  }

  void stop() override { source_->stop(); }
  double rate_hz() const override { return source_->rate_hz(); }
  std::string description() const override { return source_->description(); }
  std::int64_t lost_frames() const override { return source_->lost_frames() - lost_before_; }
  std::string warning() const override { return source_->warning(); }

 private:
  // More than a driver has buffers: those hold old frames, from before the other camera was open. A frame
  // that was delayed makes the source's begin seem late, so the earliest of several counts.
  static constexpr int kFirstFrames = 8;

  std::unique_ptr<RawFrameSource> source_;
  std::shared_ptr<CommonStart> start_;
  int seen_ = 0;
  double begin_s_ = std::numeric_limits<double>::infinity();
  std::int64_t index_ = 0;
  std::atomic<std::int64_t> lost_before_ = 0;
};

class SensorRecording {
 public:
  SensorRecording(const std::vector<RawFrameSource*>& sources, LogRecorder& recorder,
                  const RecordSensors& options)
      : sources_(sources), recorder_(recorder), options_(options), running_(sources.size()) {}

  void run() {
    std::vector<std::size_t> sensors;
    for (std::size_t sensor = 0; sensor < sources_.size(); ++sensor) sensors.push_back(sensor);
    if (options_.can_wait || sensors.size() == 1) {
      in_order_of_time(sensors);
    } else {
      std::vector<std::jthread> threads;
      for (const std::size_t sensor : sensors)
        threads.emplace_back([this, sensor] { in_order_of_time({sensor}); });
    }
    if (failure_) std::rethrow_exception(failure_);
  }

 private:
  void in_order_of_time(const std::vector<std::size_t>& sensors) {
    std::vector<std::optional<RawFrame>> heads(sources_.size());
    for (const std::size_t sensor : sensors) heads[sensor] = next(sensor);
    for (;;) {
      const std::size_t first =
          *std::min_element(sensors.begin(), sensors.end(), [&](std::size_t a, std::size_t b) {
            return heads[a] && (!heads[b] || heads[a]->time_s < heads[b]->time_s);
          });
      if (!heads[first]) return;
      const bool goes_on = record(first, std::move(*heads[first]));
      if (!goes_on) --running_;
      heads[first] = goes_on ? next(first) : std::nullopt;
    }
  }

  std::optional<RawFrame> next(std::size_t sensor) {
    try {
      if (std::optional<RawFrame> frame = sources_[sensor]->next()) return frame;
      --running_;
    } catch (const std::exception& error) {
      if (--running_ > 0)
        options_.lost(error.what());
      else
        failure_ = std::current_exception();
    }
    return std::nullopt;
  }

  bool record(std::size_t sensor, RawFrame frame) {
    if (!options_.look(sensor, frame)) return false;
    auto shared = std::make_shared<const RawFrame>(std::move(frame));
    if (options_.can_wait)
      recorder_.push_waiting(std::move(shared), sensor);
    else
      recorder_.push(std::move(shared), sensor);
    return !recorder_.status().stopped;
  }

  const std::vector<RawFrameSource*>& sources_;
  LogRecorder& recorder_;
  const RecordSensors& options_;
  std::atomic<std::size_t> running_;
  std::exception_ptr failure_;  // set by the last one only
};

}  // namespace

void put_on_one_clock(std::unique_ptr<RawFrameSource>& first, std::unique_ptr<RawFrameSource>& second) {
  const auto start = std::make_shared<CommonStart>(kNotStarted);
  for (auto* camera : {&first, &second})
    *camera = std::make_unique<SourceOnOneClock>(std::move(*camera), start);
}

void record_sensors(const std::vector<RawFrameSource*>& sources, LogRecorder& recorder,
                    const RecordSensors& options) {
  SensorRecording(sources, recorder, options).run();
}

}  // namespace gelslam
