#include "gelslam/slam/trial_places.hpp"

namespace gelslam {

void TrialPlaces::add(const std::shared_ptr<const Keyframe>& keyframe) {
  keyframes_[keyframe->id] = keyframe;
  if (keyframe->trial == 0) first_T_trial_.try_emplace(0, Pose::Identity());
  const std::vector<LoopConstraint> loops = loop_closer_.add(*keyframe);
  if (first_T_trial_.contains(keyframe->trial)) return;

  const LoopConstraint* best = nullptr;
  for (const LoopConstraint& loop : loops)
    if (first_T_trial(keyframes_.at(loop.from)->trial) && (!best || loop.sift_inliers > best->sift_inliers))
      best = &loop;
  if (!best) return;
  const Keyframe& older = *keyframes_.at(best->from);
  first_T_trial_[keyframe->trial] = normalized(first_T_trial_.at(older.trial) * older.trial_T_keyframe *
                                               best->from_T_to * keyframe->trial_T_keyframe.inverse());
}

std::optional<Pose> TrialPlaces::first_T_trial(int trial) const {
  const auto found = first_T_trial_.find(trial);
  return found == first_T_trial_.end() ? std::nullopt : std::optional<Pose>(found->second);
}

}  // namespace gelslam
