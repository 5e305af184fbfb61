#include "live/live_surface.hpp"

#include "gelslam/sensor/image_input.hpp"
#include "gelslam/surface/background.hpp"
#include "gelslam/surface/background_judgement.hpp"

namespace gelslam::slam::detail {

SurfaceStage::SurfaceStage(const Config& config, const std::filesystem::path& background, bool force,
                           LiveBoard& board, StageTimer& timer)
    : config_(config),
      force_(force),
      board_(board),
      timer_(timer),
      decoder_(config.sensor),
      color_gain_(config.color_gain_bgr),
      model_(read_gradient_model(config.sensor.calibration_model_path)) {
  if (background.empty()) return;
  cv::Mat3b image = fit_to_profile(read_image(background), config.sensor, background.string());
  color_gain_.apply(image);
  estimator_.emplace(model_, image, config.surface);
  board_.set_phase(LivePhase::scanning);
}

void SurfaceStage::run(RawQueue& in, TrackerQueue& out) {
  while (const std::optional<RawFramePtr> frame = in.pop()) {
    std::optional<TactileImage> image = decode(**frame);
    if (!image) continue;
    SurfacedFrame surfaced{std::move(*image), nullptr, (*frame)->arrived};
    if (estimator_)
      surfaced.surface = estimate(surfaced.image);
    else
      gather_background(surfaced.image);
    if (!out.push(std::move(surfaced))) return;
  }
}

std::optional<TactileImage> SurfaceStage::decode(const RawFrame& frame) {
  const auto scope = timer_.measure("decode");
  std::optional<TactileImage> image = decoder_.decode(frame);
  if (image)
    color_gain_.apply(image->bgr);
  else
    board_.frame_damaged();
  return image;
}

void SurfaceStage::gather_background(const TactileImage& image) {
  const std::size_t wanted = static_cast<std::size_t>(config_.background_frames);
  waiting_.push_back(image.bgr.clone());
  if (waiting_.size() > wanted) waiting_.pop_front();
  if (waiting_.size() < wanted) {
    board_.set_words("taking the background: do not touch the gel", TrackStatus::background);
    return;
  }
  const std::vector<cv::Mat3b> frames(waiting_.begin(), waiting_.end());
  const BackgroundCheck check =
      force_ ? BackgroundCheck{} : check_background(frames, model_, config_.surface);
  if (check.contact || check.markers) {
    board_.set_words((check.contact ? "take the object off the gel: " : "") + check.reason,
                     TrackStatus::background);
    return;
  }
  const cv::Mat3b background = background_image(frames);
  for (const std::string& doubt : judge_background(background, config_.sensor.device_name, &model_))
    board_.warn(doubt);
  estimator_.emplace(model_, background, config_.surface);
  waiting_.clear();
  board_.set_phase(LivePhase::scanning);
}

SurfacePtr SurfaceStage::estimate(const TactileImage& image) {
  const auto scope = timer_.measure("surface");
  return estimator_->estimate(image.bgr);
}

}  // namespace gelslam::slam::detail
