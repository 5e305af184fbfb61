#include <algorithm>
#include <cmath>
#include <condition_variable>
#include <mutex>

#include "gelslam/sensor/raw_log.hpp"

namespace gelslam {
namespace {

using Clock = std::chrono::steady_clock;
// A camera without a frame for 5 s ends its log, so a larger gap is a damaged time.
constexpr double kMaxGapS = 30.0;

class PacedSource final : public RawFrameSource {
 public:
  PacedSource(std::unique_ptr<RawFrameSource> source, Pace pace) : source_(std::move(source)), pace_(pace) {}

  std::optional<RawFrame> next() override {
    std::optional<RawFrame> frame =
        source_->next();  // Read before waiting, so that reading does not delay the frame.
    if (!frame) return std::nullopt;
    const double step_s = frame->time_s - last_s_.value_or(frame->time_s);
    last_s_ = frame->time_s;
    // Otherwise the time is damaged, and the frame is not delayed.
    if (std::abs(step_s) < kMaxGapS) played_s_ += step_s;
    if (!wait_until_due()) return std::nullopt;
    frame->arrived = Clock::now();
    return frame;
  }

  bool hold(bool held) override {
    {
      const std::lock_guard lock(mutex_);
      if (held && !held_since_) held_since_ = Clock::now();
      if (!held && held_since_) {
        if (start_) *start_ += Clock::now() - *held_since_;
        held_since_.reset();
      }
    }
    wake_.notify_all();
    return true;
  }

  void stop() override {
    {
      const std::lock_guard lock(mutex_);
      stopped_ = true;
    }
    wake_.notify_all();
    source_->stop();
  }

  double rate_hz() const override { return source_->rate_hz(); }
  std::optional<std::int64_t> frame_count() const override { return source_->frame_count(); }
  std::string description() const override { return source_->description(); }
  std::int64_t lost_frames() const override { return source_->lost_frames(); }
  std::string warning() const override { return source_->warning(); }

 private:
  /// Returns false once it was stopped.
  bool wait_until_due() {
    std::unique_lock lock(mutex_);
    if (!start_) start_ = Clock::now();
    while (!stopped_) {
      const Clock::time_point due = *start_ + time_to_play();
      if (held_since_)
        wake_.wait(lock);
      else if (due <= Clock::now())
        return true;
      else
        wake_.wait_until(lock, due);
    }
    return false;
  }

  Clock::duration time_to_play() const {
    if (pace_ == Pace::as_taken) return {};
    constexpr double most_s = 1e8;  // Prevents an overflow of the clock.
    return std::chrono::duration_cast<Clock::duration>(
        std::chrono::duration<double>(std::clamp(played_s_, -most_s, most_s)));
  }

  std::unique_ptr<RawFrameSource> source_;
  Pace pace_;
  std::optional<Clock::time_point> start_, held_since_;
  std::optional<double> last_s_;
  double played_s_ = 0;
  std::mutex mutex_;
  std::condition_variable wake_;
  bool stopped_ = false;
};

}  // namespace

std::unique_ptr<RawFrameSource> pace(std::unique_ptr<RawFrameSource> source, Pace pace) {
  return std::make_unique<PacedSource>(std::move(source), pace);
}

}  // namespace gelslam
