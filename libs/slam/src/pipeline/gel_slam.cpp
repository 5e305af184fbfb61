#include "gelslam/slam/gel_slam.hpp"

#include "gelslam/core/error.hpp"
#include "gelslam/slam/store.hpp"

namespace gelslam {

GelSlam::GelSlam(const SlamOptions& options, const ScanRecord& so_far, SessionQueue* session)
    : options_(options),
      tracker_(options.tracker, options.registration, options.verification),
      mapper_(options),
      frames_(so_far.frames),
      session_(session) {
  tracker_.continue_after(so_far.last_keyframe(), so_far.last_trial());
  for (const auto& [keyframe, loops] : mapper_.restore(so_far)) keep_loops(keyframe, loops);
}

TrackedFrame GelSlam::process(std::int64_t frame, double time_s, SurfacePtr surface, StageTimer& timer,
                              std::int64_t unix_us) {
  TrackedFrame tracked = track(frame, time_s, std::move(surface), timer, unix_us);
  for (const NewKeyframe& added : tracked.new_keyframes) close_loops(added, timer);
  return tracked;
}

void GelSlam::end_trial(StageTimer& timer) {
  for (const NewKeyframe& added : end_tracking()) close_loops(added, timer);
}

TrackedFrame GelSlam::track(std::int64_t frame, double time_s, SurfacePtr surface, StageTimer& timer,
                            std::int64_t unix_us) {
  if (frame >= kMaxScanFrames)
    throw Error("the scan is as long as a session can be; what comes now needs a scan of its own");
  TrackedFrame tracked;
  {
    std::optional<StageTimer::Scope> scope;
    if (surface) scope.emplace(timer, "tracking");
    tracked = tracker_.track(frame, time_s, std::move(surface), unix_us);
  }
  frames_.push_back(record_of(tracked));
  if (session_) session_->push_beyond_limit([record = frames_.back()](Store& store) { store.add(record); });
  keep(tracked.new_keyframes);
  return tracked;
}

std::vector<NewKeyframe> GelSlam::end_tracking() {
  std::vector<NewKeyframe> keyframes = tracker_.end_trial();
  keep(keyframes);
  return keyframes;
}

void GelSlam::close_loops(const NewKeyframe& added, StageTimer& timer, bool search) {
  const auto scope = timer.measure("loop closure");
  const std::vector<PoseGraphEdge> loops = mapper_.add_keyframe(added, search);
  if (search && !added.keyframe->is_patch) keep_loops(added.keyframe->id, loops);
}

void GelSlam::keep(const std::vector<NewKeyframe>& keyframes) {
  if (!session_) return;
  for (const NewKeyframe& added : keyframes)
    session_->push_beyond_limit([added](Store& store) { store.add(added); });
}

void GelSlam::keep_loops(int keyframe, const std::vector<PoseGraphEdge>& loops) {
  if (session_) session_->push_beyond_limit([=](Store& store) { store.add_loops(keyframe, loops); });
}

}  // namespace gelslam
