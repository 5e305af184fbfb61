#include "gelslam/slam/surface_stream.hpp"

#include <opencv2/core.hpp>
#include <vector>

#include "gelslam/core/error.hpp"
#include "gelslam/sensor/image_input.hpp"
#include "gelslam/slam/color_gain.hpp"
#include "gelslam/surface/background.hpp"
#include "gelslam/surface/surface_estimator.hpp"

namespace gelslam {
namespace {

std::vector<cv::Mat3b> pictures(const std::vector<TactileImage>& frames) {
  std::vector<cv::Mat3b> images;
  for (const TactileImage& frame : frames) images.push_back(frame.bgr);
  return images;
}

}  // namespace

struct SurfaceStream::Impl {
  Impl(const LogInput& input, const Config& config, StageTimer& stage_timer)
      : timer(stage_timer),
        color_gain(config.color_gain_bgr),
        source(open_frame_source(input.log, config.sensor)) {
    const GradientModel model = read_gradient_model(config.sensor.calibration_model_path);
    cv::Mat3b background;
    if (input.background.empty()) {
      read_background_frames(config.background_frames);
      if (!input.force) refuse_contact(model, config);
      background = background_image(pictures(waiting));
    } else {
      background = fit_to_profile(read_image(input.background), config.sensor, input.background.string());
      color_gain.apply(background);
    }
    for (TactileImage& frame : waiting) frame.bgr.release();
    estimator.emplace(model, background, config.surface);
  }

  std::optional<TactileImage> next_image() {
    std::optional<TactileImage> image = source->next();
    if (image) color_gain.apply(image->bgr);
    return image;
  }

  void read_background_frames(int count) {
    while (static_cast<int>(waiting.size()) < count) {
      std::optional<TactileImage> image = next_image();
      if (!image)
        throw Error("the log has only " + std::to_string(waiting.size()) + " frames, fewer than the " +
                    std::to_string(count) +
                    " without contact that it must start with (background_frames in the configuration, or "
                    "give --background)");
      waiting.push_back(std::move(*image));
    }
  }

  void refuse_contact(const GradientModel& model, const Config& config) const {
    const BackgroundCheck check = check_background(pictures(waiting), model, config.surface);
    if (check.markers) throw Error(check.reason + " (--force goes on all the same)");
    if (check.contact)
      throw Error("the log's first " + std::to_string(waiting.size()) +
                  " frames should show the bare gel, but " + check.reason +
                  " (record again without touching, give --background IMAGE, or go on with --force)");
  }

  StageTimer& timer;
  ColorGain color_gain;
  std::unique_ptr<FrameSource> source;
  std::optional<SurfaceEstimator> estimator;
  std::vector<TactileImage> waiting;  // background frames not handed out yet; their pictures are gone
  std::size_t handed_out = 0;
};

SurfaceStream::SurfaceStream(const LogInput& input, const Config& config, StageTimer& timer)
    : impl_(std::make_unique<Impl>(input, config, timer)) {}
SurfaceStream::~SurfaceStream() = default;

std::optional<SurfaceStream::Item> SurfaceStream::next() {
  if (impl_->handed_out < impl_->waiting.size()) {
    const TactileImage& frame = impl_->waiting[impl_->handed_out++];
    return Item{frame.index, frame.time_s, nullptr};
  }
  std::optional<TactileImage> image;
  {
    const auto scope = impl_->timer.measure("decode");
    image = impl_->next_image();
  }
  if (!image) return std::nullopt;
  SurfacePtr surface;
  {
    const auto scope = impl_->timer.measure("surface");
    surface = impl_->estimator->estimate(image->bgr);
  }
  const SurfaceTimings& times = impl_->estimator->timings();
  impl_->timer.add("surface/gradient", times.gradient_ms);
  impl_->timer.add("surface/poisson", times.poisson_ms);
  impl_->timer.add("surface/contact", times.contact_ms);
  impl_->timer.add("surface/normals", times.normals_ms);
  return Item{image->index, image->time_s, std::move(surface)};
}

std::optional<std::int64_t> SurfaceStream::frame_count() const { return impl_->source->frame_count(); }
std::string SurfaceStream::description() const { return impl_->source->description(); }
std::string SurfaceStream::warning() const { return impl_->source->warning(); }

}  // namespace gelslam
