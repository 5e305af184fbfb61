#include "gelslam/slam/gel_slam.hpp"

#include <vector>

#include "gelslam/slam/mapper.hpp"

namespace gelslam {

struct GelSlam::Impl {
  explicit Impl(const SlamOptions& options)
      : tracker(options.tracker, options.registration, options.verification), mapper(options) {}

  void add(const std::vector<NewKeyframe>& keyframes, StageTimer& timer) {
    for (const NewKeyframe& added : keyframes) {
      const auto scope = timer.measure("loop closure");
      mapper.add_keyframe(added);
    }
  }

  Tracker tracker;
  Mapper mapper;
  std::vector<FrameRecord> frames;
};

GelSlam::GelSlam(const SlamOptions& options, const ScanRecord& so_far)
    : impl_(std::make_unique<Impl>(options)) {
  impl_->tracker.continue_after(so_far.last_keyframe(), so_far.last_trial());
  impl_->mapper.restore(so_far);
  impl_->frames = so_far.frames;
}
GelSlam::~GelSlam() = default;
GelSlam::GelSlam(GelSlam&&) noexcept = default;

TrackedFrame GelSlam::process(std::int64_t frame, double time_s, SurfacePtr surface, StageTimer& timer,
                              std::int64_t unix_us) {
  TrackedFrame tracked;
  {
    std::optional<StageTimer::Scope> scope;
    if (surface) scope.emplace(timer, "tracking");
    tracked = impl_->tracker.track(frame, time_s, std::move(surface), unix_us);
  }
  impl_->add(tracked.new_keyframes, timer);
  impl_->frames.push_back(record_of(tracked));
  return tracked;
}

void GelSlam::end_trial(StageTimer& timer) { impl_->add(impl_->tracker.end_trial(), timer); }

SlamMap GelSlam::finish(bool refine, ProgressSink* progress,
                        const std::function<bool()>& stop_requested) const {
  return impl_->mapper.finish(impl_->frames, refine, stop_requested, progress);
}

}  // namespace gelslam
