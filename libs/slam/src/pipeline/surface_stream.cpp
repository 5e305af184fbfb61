#include "gelslam/slam/surface_stream.hpp"

#include <utility>

#include "gelslam/core/error.hpp"
#include "gelslam/sensor/image_input.hpp"

namespace gelslam {

FrameToSurface::FrameToSurface(const Config& config, const std::filesystem::path& background, bool force,
                               StageTimer& timer)
    : config_(config),
      force_(force),
      timer_(timer),
      color_gain_(config.color_gain_bgr),
      model_(read_gradient_model(config.sensor.calibration_model_path)) {
  if (background.empty()) return;
  cv::Mat3b image = fit_to_profile(read_image(background), config.sensor, background.string());
  color_gain_.apply(image);
  set_background(image);
}

SurfacePtr FrameToSurface::push(cv::Mat3b& bgr) {
  color_gain_.apply(bgr);
  if (!estimator_) {
    gather_background(bgr);
    return nullptr;
  }
  SurfacePtr surface;
  {
    const auto scope = timer_.measure("surface");
    surface = estimator_->estimate(bgr);
  }
  const SurfaceTimings& times = estimator_->timings();
  timer_.add("surface/gradient", times.gradient_ms);
  timer_.add("surface/poisson", times.poisson_ms);
  timer_.add("surface/contact", times.contact_ms);
  timer_.add("surface/normals", times.normals_ms);
  return surface;
}

void FrameToSurface::gather_background(const cv::Mat3b& bgr) {
  const auto wanted = static_cast<std::size_t>(config_.background_frames);
  candidates_.push_back(bgr.clone());
  if (candidates_.size() > wanted) candidates_.pop_front();
  if (candidates_.size() < wanted) return;
  const std::vector<cv::Mat3b> pictures(candidates_.begin(), candidates_.end());
  refusal_ = check_background(pictures, model_, config_.surface, config_.sensor.device_name);
  const bool is_refused = refusal_.contact || refusal_.markers;
  if (is_refused && !force_) return;
  if (refusal_.contact) doubts_.push_back("the background shows contact: " + refusal_.reason);
  refusal_ = {};
  set_background(background_image(pictures));
  candidates_.clear();
}

void FrameToSurface::set_background(const cv::Mat3b& background) {
  const auto markers = find_marker_dots(background);
  if (markers && !markers->are_readable() && !force_)
    throw Error(markers->sentence() + " (--force continues anyway)");
  for (std::string& doubt : judge_background(background, config_.sensor.device_name, &model_))
    doubts_.push_back(std::move(doubt));
  estimator_.emplace(model_, background, config_.surface);
}

SurfaceStream::SurfaceStream(const LogInput& input, const Config& config, StageTimer& timer)
    : SurfaceStream(open_frame_source(input.log, config.sensor), input, config, timer, {}) {}

SurfaceStream::SurfaceStream(std::unique_ptr<FrameSource> source, const LogInput& input, const Config& config,
                             StageTimer& timer, const std::function<void(const std::string&)>& ask)
    : timer_(timer), source_(std::move(source)), frames_(config, input.background, input.force, timer) {
  bool asked = false;
  read_background(config.background_frames, [&](const BackgroundCheck& refusal) {
    if (!ask)
      throw Error("the log's first " + std::to_string(background_items_.size()) +
                  " frames should show the bare gel, but " + refusal.reason +
                  (refusal.turned ? " (--force continues anyway)"
                                  : " (record again without touching, give --background IMAGE, or continue "
                                    "with --force)"));
    if (!std::exchange(asked, true)) ask(refusal.request());
  });
}

void SurfaceStream::read_background(int frames, const std::function<void(const BackgroundCheck&)>& refuse) {
  while (!frames_.has_background()) {
    std::optional<TactileImage> image = source_->next();
    if (!image)
      throw Error("the log has only " + std::to_string(background_items_.size()) +
                  " frames, fewer than the " + std::to_string(frames) +
                  " without contact that it must start with (background_frames in the configuration, or "
                  "give --background)");
    background_items_.push_back({image->index, image->time_s, nullptr});
    frames_.push(image->bgr);
    const BackgroundCheck& refusal = frames_.refusal();
    if (refusal.markers) throw Error(refusal.reason + " (--force continues anyway)");
    if (refusal.contact) refuse(refusal);
  }
}

std::optional<SurfaceStream::Item> SurfaceStream::next() {
  if (!background_items_.empty()) {
    Item item = background_items_.front();
    background_items_.pop_front();
    return item;
  }
  std::optional<TactileImage> image;
  {
    const auto scope = timer_.measure("decode");
    image = source_->next();
  }
  if (!image) return std::nullopt;
  SurfacePtr surface = frames_.push(image->bgr);
  return Item{image->index, image->time_s, std::move(surface), std::move(image->bgr)};
}

}  // namespace gelslam
