#include "rejoin.hpp"

#include "gelslam/loop_closure/self_similarity.hpp"

namespace gelslam::slam::detail {
namespace {

/// `before` is the last frame of a trial, `after` the first of the next.
bool lost_in_touch(const FrameRecord& before, const FrameRecord& after) {
  return before.keyframe >= 0 && after.keyframe >= 0 && after.trial == before.trial + 1 &&
         after.frame == before.frame + 1;
}

}  // namespace

std::vector<LoopConstraint> rejoin_broken_trials(
    const std::vector<std::shared_ptr<const Keyframe>>& keyframes, const std::vector<FrameRecord>& frames,
    const LoopCloser& loop_closer, double max_self_similarity) {
  std::vector<LoopConstraint> found;
  for (std::size_t i = 1; i < frames.size(); ++i) {
    const FrameRecord &before = frames[i - 1], &after = frames[i];
    if (!lost_in_touch(before, after)) continue;
    const auto& older = keyframes[static_cast<std::size_t>(before.keyframe)];
    const auto& newer = keyframes[static_cast<std::size_t>(after.keyframe)];
    if (!older || !newer || self_similarity(*newer->surface) > max_self_similarity) continue;
    const std::optional<LoopConstraint> loop =
        loop_closer.verify(*older, *newer, before.keyframe_T_frame * after.keyframe_T_frame.inverse());
    if (loop) found.push_back(*loop);
  }
  return found;
}

}  // namespace gelslam::slam::detail
