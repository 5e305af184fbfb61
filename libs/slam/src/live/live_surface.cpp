#include "live/live_stages.hpp"

namespace gelslam::slam::detail {

SurfaceStage::SurfaceStage(LiveContext& context)
    : context_(context),
      decoder_(context.options.config.sensor),
      frames_(context.options.config, context.options.background, context.options.force, context.timer,
              context.options.background_frames) {
  if (frames_.has_background()) report_background();
}

void SurfaceStage::run() {
  const auto most_background_frames = static_cast<std::size_t>(context_.options.config.background_frames);
  while (const std::optional<RawFramePtr> frame = context_.raw.pop()) {
    std::optional<TactileImage> image = decode(**frame);
    if (!image) continue;
    if ((*frame)->returns != returns_) {
      returns_ = (*frame)->returns;
      context_.surfaced.push_beyond_limit(BreakTrial{});
      frames_.compare_background();
      report_background();
    }
    const bool had_background = frames_.has_background();
    SurfacePtr surface = frames_.push(image->bgr, image->index);
    if (!had_background) {
      background_frames_.push_back(*frame);
      if (background_frames_.size() > most_background_frames) background_frames_.pop_front();
      report_background();
    }
    if (!frames_.difference().empty()) {
      context_.board.warn(frames_.difference());
      context_.lost = true;
      return;
    }
    if (had_background)
      for (const std::string& doubt : frames_.doubts()) context_.board.warn(doubt);
    const LiveClock::time_point arrived = (*frame)->arrived;
    if (!context_.surfaced.push(
            SurfacedFrame{{std::move(*image), std::move(surface)}, arrived, arrived - (*frame)->age}))
      return;
  }
}

std::optional<TactileImage> SurfaceStage::decode(const RawFrame& frame) {
  const auto scope = context_.timer.measure("decode");
  std::optional<TactileImage> image = decoder_.decode(frame);
  if (!image) {
    context_.board.frame_damaged();
    context_.board.warn_about("the pictures", decoder_.warning());
  }
  return image;
}

BackgroundFrames SurfaceStage::background_frames() const {
  if (!frames_.has_background()) return {};
  return {background_frames_.begin(), background_frames_.end()};
}

void SurfaceStage::report_background() {
  if (frames_.has_background()) {
    for (const std::string& doubt : frames_.doubts()) context_.board.warn(doubt);
    context_.board.set_phase(LivePhase::scanning);
    return;
  }
  context_.board.set_phase(LivePhase::background);
  const BackgroundCheck& refusal = frames_.refusal();
  const std::string words = refusal.contact   ? refusal.request()
                            : refusal.markers ? refusal.reason
                                              : std::string("taking the background: do not touch the gel");
  context_.board.set_words(words, TrackStatus::background);
}

}  // namespace gelslam::slam::detail
