#include "live/live_tracking.hpp"

#include <algorithm>

namespace gelslam::slam::detail {

TrackingStage::TrackingStage(const SlamOptions& options, std::optional<double> relocalization_share,
                             const ScanRecord& so_far, PoseStream* stream, SessionQueue& session,
                             LiveBoard& board, StageTimer& timer)
    : so_far_(so_far),
      tracker_(options.tracker, options.registration, options.verification),
      stream_(stream),
      board_(board),
      timer_(timer),
      session_(session),
      first_frame_(so_far.next_frame()),
      first_time_s_(so_far.next_time_s()),
      records_(so_far.frames) {
  if (relocalization_share)
    tracker_.limit_relocalization(*relocalization_share, [] {
      return std::chrono::duration<double>(LiveClock::now().time_since_epoch()).count();
    });
  tracker_.continue_after(so_far.last_keyframe(), so_far.last_trial());
}

void TrackingStage::run(TrackerQueue& in, MapperQueue& out) {
  if (stream_)
    for (const auto& keyframe : so_far_.keyframes)
      if (keyframe) stream_->keep(*keyframe);
  while (const std::optional<TrackerMessage> message = in.pop())
    std::visit([&](const auto& content) { handle(content, out); }, *message);
}

void TrackingStage::handle(const SurfacedFrame& frame, MapperQueue& out) {
  const std::int64_t index = first_frame_ + frame.image.index;
  const double time_s = first_time_s_ + frame.image.time_s;
  if (!frame.surface) {
    record(background_record(index, time_s));
    TrackedFrame background;
    background.frame = index;
    background.time_s = time_s;
    background.status = TrackStatus::background;
    LiveTouch bare;
    bare.index = index;
    bare.time_s = time_s;
    bare.image = frame.image.bgr;
    bare.status = TrackStatus::background;
    board_.set_touch(std::move(bare), "", frame.arrived);
    return stream(background, frame);
  }
  TrackedFrame tracked;
  {
    const auto scope = timer_.measure("tracking");
    tracked = tracker_.track(index, time_s, frame.surface);
  }
  timer_.add("arrival to pose",
             std::chrono::duration<double, std::milli>(LiveClock::now() - frame.arrived).count());
  stream(tracked, frame);
  record(record_of(tracked));
  for (const NewKeyframe& added : tracked.new_keyframes)
    session_.push_beyond_limit([added](Store& store) { store.add(added); });
  if (tracked.status == TrackStatus::tracked) hidden_.pass(tracked.trial, tracked.registration.observable);
  LiveTouch touch{tracked.frame,
                  tracked.time_s,
                  frame.image.bgr,
                  frame.surface,
                  tracked.status,
                  tracked.keyframe ? tracked.keyframe->id : -1,
                  tracked.keyframe_T_frame,
                  tracked.trial,
                  tracked.trial_T_frame,
                  hidden_.words()};
  const std::string why_lost = tracked.status == TrackStatus::lost
                                   ? std::string(describe(tracked.registration.status))
                                   : std::string();
  board_.set_touch(std::move(touch), why_lost, frame.arrived);
  for (const NewKeyframe& added : tracked.new_keyframes) out.push_beyond_limit(added);
}

void TrackingStage::stream(const TrackedFrame& tracked, const SurfacedFrame& frame) {
  if (stream_ == nullptr) return;
  const auto arrived =
      std::chrono::system_clock::now().time_since_epoch() - (LiveClock::now() - frame.arrived);
  FrameReport report{tracked, frame.surface.get(), std::chrono::duration<double>(arrived).count()};
  report.picture = frame.image.bgr;
  stream_->write(std::move(report), *board_.map());
}

void TrackingStage::handle(UndoTrial, MapperQueue& out) {
  int trial = -1;
  {
    const std::lock_guard lock(mutex_);
    for (const FrameRecord& record : records_)
      if (record.keyframe >= 0) trial = std::max(trial, record.trial);
    for (FrameRecord& record : records_) {
      if (record.keyframe < 0 || record.trial != trial) continue;
      record.status = TrackStatus::undone;
      record.keyframe = -1;
    }
  }
  tracker_.break_trial();
  if (trial < 0) return;
  session_.push_beyond_limit([trial](Store& store) { store.forget_from_trial(trial); });
  out.push_beyond_limit(ForgetFromTrial{trial});
}

void TrackingStage::record(const FrameRecord& record) {
  session_.push_beyond_limit([record](Store& store) { store.add(record); });
  const std::lock_guard lock(mutex_);
  records_.push_back(record);
}

std::vector<FrameRecord> TrackingStage::records() const {
  const std::lock_guard lock(mutex_);
  return records_;
}

}  // namespace gelslam::slam::detail
