#include "gelslam/slam/gel_slam.hpp"

namespace gelslam {

GelSlam::GelSlam(const SlamOptions& options) : tracker_(options.tracker), mapper_(options) {}

TrackedFrame GelSlam::process(std::int64_t frame, double time_s, SurfacePtr surface, StageTimer& timer) {
  TrackedFrame tracked;
  {
    const auto scope = timer.measure("tracking");
    tracked = tracker_.track(frame, time_s, std::move(surface));
  }
  if (tracked.turning_point || tracked.new_keyframe) {
    const auto scope = timer.measure("loop closure");
    if (tracked.turning_point) mapper_.add_keyframe(tracked.turning_point, tracked.turning_point_link);
    if (tracked.new_keyframe) mapper_.add_keyframe(tracked.new_keyframe, tracked.new_keyframe_link);
  }
  frames_.push_back(record_of(tracked));
  return tracked;
}

void GelSlam::skip(std::int64_t frame, double time_s) { frames_.push_back(background_record(frame, time_s)); }

SlamMap GelSlam::finish() const {
  return mapper_.finish(frames_, true, [] { return false; });
}

}  // namespace gelslam
