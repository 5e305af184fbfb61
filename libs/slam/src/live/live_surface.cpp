#include "live/live_surface.hpp"

namespace gelslam::slam::detail {

SurfaceStage::SurfaceStage(const LiveOptions& options, LiveBoard& board, StageTimer& timer)
    : board_(board),
      timer_(timer),
      decoder_(options.config.sensor),
      frames_(options.config, options.background, options.force, timer, options.background_frames),
      most_background_frames_(static_cast<std::size_t>(options.config.background_frames)) {
  if (frames_.has_background()) report_background();
}

void SurfaceStage::run(RawQueue& in, TrackerQueue& out) {
  while (const std::optional<RawFramePtr> frame = in.pop()) {
    std::optional<TactileImage> image = decode(**frame);
    if (!image) continue;
    const bool had_background = frames_.has_background();
    SurfacePtr surface = frames_.push(image->bgr, image->index);
    if (!had_background) {
      background_frames_.push_back(*frame);
      if (background_frames_.size() > most_background_frames_) background_frames_.pop_front();
      report_background();
    }
    if (!out.push(SurfacedFrame{std::move(*image), std::move(surface), (*frame)->arrived})) return;
  }
}

std::optional<TactileImage> SurfaceStage::decode(const RawFrame& frame) {
  const auto scope = timer_.measure("decode");
  std::optional<TactileImage> image = decoder_.decode(frame);
  if (!image) {
    board_.frame_damaged();
    board_.warn_about("the pictures", decoder_.warning());
  }
  return image;
}

BackgroundFrames SurfaceStage::background_frames() const {
  if (!frames_.has_background()) return {};
  return {background_frames_.begin(), background_frames_.end()};
}

void SurfaceStage::report_background() {
  if (frames_.has_background()) {
    for (const std::string& doubt : frames_.doubts()) board_.warn(doubt);
    board_.set_phase(LivePhase::scanning);
    return;
  }
  const BackgroundCheck& refusal = frames_.refusal();
  const std::string words = refusal.contact   ? refusal.request()
                            : refusal.markers ? refusal.reason
                                              : std::string("taking the background: do not touch the gel");
  board_.set_words(words, TrackStatus::background);
}

}  // namespace gelslam::slam::detail
