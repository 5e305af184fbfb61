#include "track_output.hpp"

#include <utility>

namespace gelslam {

FrameLocator locate_in_trials(const SlamOptions& options) {
  const auto tracker = std::make_shared<Tracker>(options.tracker, options.registration, options.verification);
  const auto map = std::make_shared<TrialMap>(options.gradient_scale);
  return [=](const SurfaceStream::Item& item) {
    const TactileImage& image = item.image;
    FrameReport report{.tracked = tracker->track(image.index, image.time_s, item.surface, image.unix_us),
                       .image = image.bgr,
                       .surface = item.surface};
    report.in_trial = report.in_map = map->add(report.tracked);
    return report;
  };
}

FrameLocator locate_in_map(std::shared_ptr<const SurfaceMap> map, const SlamOptions& options) {
  const auto localizer = std::make_shared<Localizer>(std::move(map), options);
  return [=](const SurfaceStream::Item& item) {
    const TactileImage& image = item.image;
    FrameReport report = localizer->process(image.index, image.time_s, item.surface, image.unix_us);
    report.image = image.bgr;
    return report;
  };
}

}  // namespace gelslam
