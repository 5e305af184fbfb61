#include "gelslam/slam/gel_slam.hpp"

namespace gelslam {

GelSlam::GelSlam(const SlamOptions& options, const ScanRecord& so_far)
    : tracker_(options.tracker, options.registration, options.verification),
      mapper_(options),
      frames_(so_far.frames) {
  tracker_.continue_after(so_far.last_keyframe(), so_far.last_trial());
  mapper_.restore(so_far);
}

TrackedFrame GelSlam::process(std::int64_t frame, double time_s, SurfacePtr surface, StageTimer& timer,
                              std::int64_t unix_us) {
  TrackedFrame tracked;
  {
    std::optional<StageTimer::Scope> scope;
    if (surface) scope.emplace(timer, "tracking");
    tracked = tracker_.track(frame, time_s, std::move(surface), unix_us);
  }
  add(tracked.new_keyframes, timer);
  frames_.push_back(record_of(tracked));
  return tracked;
}

void GelSlam::end_trial(StageTimer& timer) { add(tracker_.end_trial(), timer); }

void GelSlam::add(const std::vector<NewKeyframe>& keyframes, StageTimer& timer) {
  for (const NewKeyframe& added : keyframes) {
    const auto scope = timer.measure("loop closure");
    mapper_.add_keyframe(added);
  }
}

}  // namespace gelslam
