#include <algorithm>

#include "gelslam/slam/pose_stream.hpp"
#include "live/live_stages.hpp"

namespace gelslam::slam::detail {

TrackingStage::TrackingStage(LiveContext& context)
    : context_(context),
      tracker_(context.options.config.slam.tracker, context.options.config.slam.registration,
               context.options.config.slam.verification),
      first_frame_(context.so_far.next_frame()),
      first_time_s_(context.so_far.next_time_s()),
      records_(context.so_far.frames) {
  tracker_.continue_after(context.so_far.last_keyframe(), context.so_far.last_trial());
}

void TrackingStage::run() {
  while (const std::optional<TrackerMessage> message = context_.surfaced.pop())
    std::visit([this](const auto& content) { handle(content); }, *message);
  hand_on(tracker_.end_trial());
}

void TrackingStage::handle(const SurfacedFrame& frame) {
  const TactileImage& image = frame.image;
  TrackedFrame tracked;
  {
    std::optional<StageTimer::Scope> scope;
    if (frame.surface) scope.emplace(context_.timer, "tracking");
    tracked = tracker_.track(first_frame_ + image.index, first_time_s_ + image.time_s, frame.surface,
                             image.unix_us);
  }
  stream(tracked, frame);
  if (frame.surface)
    context_.timer.add("capture to pose",
                       std::chrono::duration<double, std::milli>(LiveClock::now() - frame.captured).count());
  const FrameRecord kept = record_of(tracked);
  record(kept);
  if (tracked.status == TrackStatus::tracked) hidden_.pass(tracked.trial, tracked.registration.observable);
  LiveTouch touch{kept, image.bgr, frame.surface, tracked.trial_T_frame, hidden_.words()};
  const std::string why_lost = tracked.status == TrackStatus::lost
                                   ? std::string(describe(tracked.registration.status))
                                   : std::string();
  context_.board.set_touch(std::move(touch), why_lost, frame.captured);
  hand_on(tracked.new_keyframes);
}

/// To the session and to the mapper.
void TrackingStage::hand_on(const std::vector<NewKeyframe>& keyframes) {
  for (const NewKeyframe& added : keyframes) {
    context_.measured.push_beyond_limit([added](Store& store) { store.add(added); });
    context_.keyframes.push_beyond_limit(added);
  }
}

void TrackingStage::stream(const TrackedFrame& tracked, const SurfacedFrame& frame) {
  if (!context_.options.stream) return;
  FrameReport report{tracked, frame.surface.get()};
  report.picture = frame.image.bgr;
  context_.options.stream->write(std::move(report), *context_.board.map());
}

void TrackingStage::record(const FrameRecord& record) {
  context_.measured.push_beyond_limit([record](Store& store) { store.add(record); });
  const std::lock_guard lock(mutex_);
  records_.push_back(record);
}

std::vector<FrameRecord> TrackingStage::records() const {
  const std::lock_guard lock(mutex_);
  return records_;
}

}  // namespace gelslam::slam::detail
