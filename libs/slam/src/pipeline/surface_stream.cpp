#include "gelslam/slam/surface_stream.hpp"

#include <fmt/core.h>

#include <opencv2/core.hpp>
#include <utility>

#include "gelslam/core/error.hpp"
#include "gelslam/core/even_sample.hpp"
#include "gelslam/core/text.hpp"
#include "gelslam/surface/background_drift.hpp"
#include "gelslam/surface/model_file.hpp"

namespace gelslam {
namespace {

// If a log does not begin with bare gel, the background is searched for within this many times the number of
// background frames.
constexpr std::size_t kLookAhead = 4;  // All of these images are held in memory.

std::string ended_early(std::size_t frames, const LogInput& input, int wanted) {
  if (input.background_frames)
    return "the log ends before frame " + std::to_string(input.background_frames->last) +
           ", the last that was named for the background";
  return "the log has only " + counted(frames, "frame") + ", fewer than the " + std::to_string(wanted) +
         " without contact that it must start with (background_frames in the configuration, or name a "
         "background picture)";
}

/// Returns up to 64 images at even distances over the whole log.
std::deque<TactileImage> some_of(FrameSource& log) {
  EvenSample<TactileImage> sample(64);  // The number bounds the memory.
  for (std::int64_t i = 0; std::optional<TactileImage> image = log.next(); ++i)
    sample.add(i, std::move(*image));
  std::deque<TactileImage> some;
  for (auto& [i, image] : sample.items()) some.push_back(std::move(image));
  return some;
}

SurfaceStream::Item bare_item(const TactileImage& image) {
  return {{{}, image.time_s, image.index, image.unix_us}, nullptr};
}

}  // namespace

FrameToSurface::FrameToSurface(const Config& config, const std::filesystem::path& background, bool force,
                               StageTimer& timer, const std::optional<FrameRange>& named)
    : config_(config),
      force_(force),
      named_(named),
      timer_(timer),
      color_gain_(config.color_gain_bgr),
      model_(read_gradient_model(config.sensor.calibration_model_path)) {
  if (background.empty()) return;
  cv::Mat3b image = fit_to_profile(read_image(background), config.sensor, background.string());
  color_gain_.apply(image);
  set_background(image);
}

SurfacePtr FrameToSurface::push(cv::Mat3b& bgr, std::int64_t index) {
  color_gain_.apply(bgr);
  if (!has_background()) {
    gather_background(bgr, index);
    if (!has_background() || index <= last_for_background_) return nullptr;
  }
  SurfacePtr surface;
  {
    const auto scope = timer_.measure("surface");
    surface = estimator_->estimate(bgr);
  }
  if (!estimator_->light_is_followed() && !std::exchange(light_is_lost_, true))
    warnings_.emplace_back(
        "light changes over the gel by more than can be taken off: surfaces are wrong there; shade the "
        "sensor");
  const SurfaceTimings& times = estimator_->timings();
  timer_.add("surface/gradient", times.gradient_ms);
  timer_.add("surface/poisson", times.poisson_ms);
  timer_.add("surface/contact", times.contact_ms);
  timer_.add("surface/normals", times.normals_ms);
  return surface;
}

void FrameToSurface::gather_background(const cv::Mat3b& bgr, std::int64_t index) {
  if (named_ && index < named_->first) return;
  // Frames are counted by their index, so that damaged images within the background's range do not let later
  // images become background.
  const std::int64_t wanted = config_.background_frames;
  if (last_for_background_ < 0)
    last_for_background_ = named_ ? named_->last : (index < wanted ? 0 : index) + wanted - 1;
  if (index <= last_for_background_ || candidates_.empty() || refusal_.contact || refusal_.markers) {
    candidates_.push_back(bgr.clone());
    if (index > last_for_background_) candidates_.pop_front();
    last_for_background_ = std::max(last_for_background_, index);
  }
  if (index < last_for_background_) return;
  const std::vector<cv::Mat3b> pictures(candidates_.begin(), candidates_.end());
  refusal_ = check_background(pictures, model_, config_.surface, config_.sensor.device_name);
  if (named_ && refusal_.moves && !force_)
    throw Error("the named frames should show the bare gel, but " + refusal_.reason);
  const bool is_refused = refusal_.markers || (refusal_.contact && !named_);
  if (is_refused && !force_) {
    if (refusal_.contact) explain_refusal(background_image(pictures));
    return;
  }
  if (refusal_.contact)
    warnings_.emplace_back(
        "the background shows contact, and surfaces may be wrong: record the bare gel again");
  refusal_ = {};
  candidates_.clear();
  compares_ ? compare_with(background_image(pictures)) : set_background(background_image(pictures));
}

/// If contact is only inferred from an imprint, other lamps or another model are a more likely cause, and
/// their warnings come first. If the images move, contact is certain, and its reason comes first.
void FrameToSurface::explain_refusal(const cv::Mat3b& background) {
  std::string warnings;
  if (!refusal_.turned)
    for (const std::string& warning :
         judge_background(MarkerFiller(background).background(), config_.sensor.device_name, &model_))
      if (warning != kMakerModelWarning) append_sentence(warnings, warning);
  if (!refusal_.moves) std::swap(warnings, refusal_.reason);
  append_sentence(refusal_.reason, warnings);
}

/// Compares the background that the user named with the first images of the log.
void FrameToSurface::compare_named_background(const std::deque<TactileImage>& first) {
  const std::vector<cv::Mat3b> pictures = brightened(first);
  const cv::Mat3b seen = background_image(pictures);
  const BackgroundDrift drift = measure_drift(background_cells(background_), background_cells(seen));
  const bool is_touched = check_background(pictures, model_, config_.surface).contact;
  std::string difference;
  if (drift.light_changed || (drift.gel_changed && !is_touched))
    difference = drift.difference;
  else if (!is_touched &&
           SurfaceEstimator(model_, seen, config_.surface).estimate(background_)->contact_mm2() >
               config_.slam.tracker.min_contact_mm2)
    difference = "something touches the gel in it, or in these";
  if (!difference.empty())
    warnings_.push_back("the background picture differs from the first frames of the log: " + difference);
}

void FrameToSurface::compare_background() {
  // If there is no background yet, the images gathered so far do not belong to it.
  compares_ = estimator_.has_value();
  named_.reset();
  last_for_background_ = -1;
  candidates_.clear();
}

/// The estimator decides what differs, because changes of light that it can compensate do no harm.
void FrameToSurface::compare_with(const cv::Mat3b& background) {
  compares_ = false;
  const SurfacePtr surface = estimator_->estimate(background);
  if (surface->contact_mm2() < config_.slam.tracker.min_contact_mm2) return;
  const cv::Scalar was = cv::mean(background_), is = cv::mean(background);
  difference_ = fmt::format(
      "since the camera came back {} % of the bare gel looks different (mean blue, green, red {:.0f} {:.0f} "
      "{:.0f} before, {:.0f} {:.0f} {:.0f} now): scan with this gel and light anew",
      100 * surface->contact_pixels / static_cast<int>(background.total()), was[0], was[1], was[2], is[0],
      is[1], is[2]);
}

std::vector<cv::Mat3b> FrameToSurface::brightened(const std::deque<TactileImage>& images) const {
  std::vector<cv::Mat3b> pictures;
  for (const TactileImage& image : images) {
    pictures.push_back(image.bgr.clone());
    color_gain_.apply(pictures.back());
  }
  return pictures;
}

std::optional<BareStretch> FrameToSurface::take_bare_stretch(const std::deque<TactileImage>& seen,
                                                             const std::filesystem::path& log) {
  const std::vector<cv::Mat3b> pictures = brightened(seen);
  const auto most = static_cast<std::size_t>(config_.background_frames);
  auto stretch = find_bare_stretch(pictures, most, model_, config_.surface);
  if (!stretch && !log.empty())
    stretch = find_bare_stretch(pictures, most, model_, config_.surface,
                                brightened(some_of(*open_frame_source(log, config_.sensor))));
  if (!stretch) return std::nullopt;
  if (stretch->imprint_mm > 0)
    warnings_.push_back(fmt::format(
        "all of the log shows what looks like an imprint, about {:.1f} mm deep: it counts as the gel's own "
        "(wear, light)",
        stretch->imprint_mm));
  const auto first = pictures.begin() + static_cast<std::ptrdiff_t>(stretch->begin);
  set_background(background_image({first, first + static_cast<std::ptrdiff_t>(stretch->count)}));
  if (stretch->begin > 0 || stretch->count < most)
    warnings_.push_back("the background is that of frames " + std::to_string(seen[stretch->begin].index) +
                        " to " + std::to_string(seen[stretch->begin + stretch->count - 1].index) +
                        (stretch->begin > 0
                             ? ", not the old ones before; name others as background frames"
                             : fmt::format(": of the {} asked for, only these show the bare gel", most)));
  return stretch;
}

void FrameToSurface::set_background(const cv::Mat3b& background) {
  const auto markers = find_marker_dots(background);
  if (markers && !markers->are_readable() && !force_)
    throw Error(markers->sentence() + " (force continues anyway)");
  for (std::string& warning :
       judge_background(background, config_.sensor.device_name, &model_, config_.surface.pixel_pitch_mm))
    warnings_.push_back(std::move(warning));
  estimator_.emplace(model_, background, config_.surface);
  background_ = background;
}

SurfaceStream::SurfaceStream(const LogInput& input, const Config& config, StageTimer& timer)
    : SurfaceStream(open_frame_source(input.log, config.sensor), input, config, timer, {}) {}

SurfaceStream::SurfaceStream(std::unique_ptr<FrameSource> source, const LogInput& input, const Config& config,
                             StageTimer& timer, const std::function<void(const std::string&)>& ask)
    : timer_(timer),
      source_(std::move(source)),
      frames_(config, input.background, input.force, timer, input.background_frames) {
  bool asked = false;
  std::deque<TactileImage> seen;
  if (frames_.has_background() && !ask) {
    read_ahead(ahead_, static_cast<std::size_t>(config.background_frames));
    if (!ahead_.empty()) frames_.compare_named_background(ahead_);
  }
  while (!frames_.has_background()) {
    std::optional<TactileImage> image = source_->next();
    if (!image) throw Error(ended_early(seen.size(), input, config.background_frames));
    background_items_.push_back(bare_item(*image));
    if (!ask) seen.push_back({image->bgr.clone(), image->time_s, image->index, image->unix_us});
    // A damaged image was skipped, and this one is beyond the background already.
    if (SurfacePtr surface = frames_.push(image->bgr, image->index))
      background_items_.back() = {*std::move(image), std::move(surface)};
    const BackgroundCheck& refusal = frames_.refusal();
    if (!refusal.contact && !refusal.markers) continue;
    if (!ask &&
        look_further(seen, kLookAhead * static_cast<std::size_t>(config.background_frames), input.log))
      return;
    if (refusal.markers) throw Error(refusal.reason + " (force continues anyway)");
    if (!ask)
      throw Error("the log's first " + std::to_string(background_items_.size()) +
                  " frames should show the bare gel, but " + refusal.reason +
                  (refusal.turned ? " (force continues anyway)"
                                  : " (record again without touching, name background frames or "
                                    "a background picture, or continue with force)"));
    if (!std::exchange(asked, true)) ask(refusal.request());
  }
}

void SurfaceStream::read_ahead(std::deque<TactileImage>& seen, std::size_t most) {
  while (seen.size() < most) {
    std::optional<TactileImage> image = source_->next();
    if (!image) break;
    seen.push_back(std::move(*image));
  }
}

/// Searches for the background beyond the images in `seen`; returns whether it was found.
bool SurfaceStream::look_further(std::deque<TactileImage> seen, std::size_t most,
                                 const std::filesystem::path& log) {
  read_ahead(seen, most);
  const auto stretch = frames_.take_bare_stretch(seen, log);
  if (!stretch) return false;
  background_items_.clear();
  for (std::size_t i = 0; i < stretch->begin + stretch->count; ++i, seen.pop_front())
    background_items_.push_back(bare_item(seen.front()));
  ahead_ = std::move(seen);
  return true;
}

std::optional<SurfaceStream::Item> SurfaceStream::next() {
  if (!background_items_.empty()) {
    Item item = background_items_.front();
    background_items_.pop_front();
    return item;
  }
  std::optional<TactileImage> image = next_image();
  if (!image) return std::nullopt;
  SurfacePtr surface = frames_.push(image->bgr, image->index);
  return Item{*std::move(image), std::move(surface)};
}

std::optional<TactileImage> SurfaceStream::next_image() {
  if (ahead_.empty()) {
    const auto scope = timer_.measure("decode");
    return source_->next();
  }
  TactileImage image = std::move(ahead_.front());
  ahead_.pop_front();
  return image;
}

}  // namespace gelslam
