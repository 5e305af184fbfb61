#include <algorithm>

#include "gelslam/core/text.hpp"
#include "gelslam/slam/pose_stream.hpp"
#include "live/live_stages.hpp"

namespace gelslam::slam::detail {

void TrackingStage::run() {
  while (const std::optional<TrackerMessage> message = context_.surfaced.pop())
    std::visit([this](const auto& content) { handle(content); }, *message);
  hand_on(context_.slam->end_tracking());
}

void TrackingStage::handle(const SurfacedFrame& frame) {
  const TactileImage& image = frame.image;
  const ScanRecord& so_far = context_.so_far;
  const TrackedFrame tracked =
      context_.slam->track(so_far.next_frame() + image.index, so_far.next_time_s() + image.time_s,
                           frame.surface, context_.timer, image.unix_us);
  stream(tracked, frame);
  if (frame.surface)
    context_.timer.add("capture to pose",
                       std::chrono::duration<double, std::milli>(LiveClock::now() - frame.captured).count());
  if (tracked.status == TrackStatus::tracked) hidden_.pass(tracked.trial, tracked.registration.observable);
  LiveTouch touch{record_of(tracked), image.bgr, frame.surface, tracked.trial_T_frame, hidden_.words()};
  if (touch.apart) append_sentence(touch.hidden, std::string(kApart));
  const std::string why_lost = tracked.status == TrackStatus::lost
                                   ? std::string(describe(tracked.registration.status))
                                   : std::string();
  context_.board.set_touch(std::move(touch), why_lost, frame.captured);
  hand_on(tracked.new_keyframes);
}

/// To the mapper.
void TrackingStage::hand_on(const std::vector<NewKeyframe>& keyframes) {
  for (const NewKeyframe& added : keyframes) context_.keyframes.push_beyond_limit(added);
}

void TrackingStage::stream(const TrackedFrame& tracked, const SurfacedFrame& frame) {
  if (!context_.options.stream) return;
  FrameReport report{tracked, frame.surface.get()};
  report.picture = frame.image.bgr;
  context_.options.stream->write(std::move(report), *context_.board.map());
}

}  // namespace gelslam::slam::detail
