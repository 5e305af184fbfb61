#include "gelslam/slam/gel_slam.hpp"

namespace gelslam {

GelSlam::GelSlam(const SlamOptions& options)
    : tracker_(options.tracker, options.registration, options.verification), mapper_(options) {}

TrackedFrame GelSlam::process(std::int64_t frame, double time_s, SurfacePtr surface, StageTimer& timer) {
  TrackedFrame tracked;
  {
    const auto scope = timer.measure("tracking");
    tracked = tracker_.track(frame, time_s, std::move(surface));
  }
  for (const NewKeyframe& added : tracked.new_keyframes) {
    const auto scope = timer.measure("loop closure");
    mapper_.add_keyframe(added);
  }
  frames_.push_back(record_of(tracked));
  return tracked;
}

void GelSlam::skip(std::int64_t frame, double time_s) { frames_.push_back(background_record(frame, time_s)); }

SlamMap GelSlam::finish() const {
  return mapper_.finish(frames_, true, [] { return false; });
}

}  // namespace gelslam
