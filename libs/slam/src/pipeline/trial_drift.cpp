#include "gelslam/slam/trial_drift.hpp"

#include <array>

#include "gelslam/core/se3.hpp"
#include "gelslam/core/text.hpp"
#include "gelslam/slam/slam_map.hpp"

namespace gelslam {

namespace {

UncertainMotion onward(const UncertainMotion& trial_T_previous, const KeyframeLink& link) {
  UncertainMotion motion = compose(trial_T_previous, uncertain_motion(odometry_edge(link, -1)));
  motion.from_T_to = normalized(motion.from_T_to);
  return motion;
}

}  // namespace

std::optional<Matrix6d> TrialDrift::add(const TrackedFrame& frame) {
  if (frame.trial != trial_ && frame.trial >= 0) {
    trial_ = frame.trial;
    trial_T_keyframes_.clear();
  }
  for (const NewKeyframe& added : frame.new_keyframes) {
    if (added.keyframe->trial != trial_) continue;  // left behind by the trial before
    trial_T_keyframes_[added.keyframe->id] =
        added.link.previous ? onward(trial_T_keyframes_.at(added.link.previous->id), added.link)
                            : UncertainMotion();
  }
  if (frame.left && !trial_T_keyframes_.contains(frame.keyframe->id))  // a keyframe of another trial
    trial_T_keyframes_[frame.keyframe->id] =
        compose(onward(trial_T_keyframes_.at(frame.left->previous->id), *frame.left),
                inverse(uncertain_motion(odometry_edge(link_to(frame.keyframe, frame.registration), -1))));
  if (frame.status != TrackStatus::tracked) return std::nullopt;
  UncertainMotion motion = trial_T_keyframes_.at(frame.keyframe->id);
  if (frame.keyframe->frame != frame.frame)
    motion = onward(motion, link_to(frame.keyframe, frame.registration));
  return translation_first(
      motion.covariance_with_scale(gradient_scale_sigma_ * frame.keyframe->surface.model_sigma()));
}

Matrix6d translation_first(const Matrix6d& rotation_first) {
  Matrix6d covariance;
  covariance << rotation_first.bottomRightCorner<3, 3>(), rotation_first.bottomLeftCorner<3, 3>(),
      rotation_first.topRightCorner<3, 3>(), rotation_first.topLeftCorner<3, 3>();
  return covariance;
}

Vector6d sigma_of(const Matrix6d& covariance) { return covariance.diagonal().cwiseMax(0.0).cwiseSqrt(); }

std::string describe_drift(const Vector6d& sigma) {
  constexpr double kMuchMm = 1.0, kMuchDeg = 5.0, kTwoSigma = 2.0;
  constexpr std::array<const char*, 3> kAxes = {"x", "y", "z"};
  std::string where;
  const auto add = [&](const char* pattern, double two_sigma, std::size_t axis) {
    where += (where.empty() ? "" : ", ") + format_text(pattern, two_sigma, kAxes[axis]);
  };
  for (std::size_t axis = 0; axis < 3; ++axis)
    if (const double mm = kTwoSigma * sigma[static_cast<int>(axis)]; mm > kMuchMm)
      add("%.1f mm along %s", mm, axis);
  for (std::size_t axis = 0; axis < 3; ++axis)
    if (const double deg = kTwoSigma * kDegreesPerRadian * sigma[static_cast<int>(axis) + 3]; deg > kMuchDeg)
      add("%.0f degrees about %s", deg, axis);
  return where.empty() ? "" : "may be off by " + where + " since the trial began";
}

void HiddenMotions::pass(int trial, double time_s, const std::array<bool, 6>& observable) {
  if (trial != trial_) {
    trial_ = trial;
    observable_.fill(true);
    agreed_s_.fill(time_s);
  }
  for (std::size_t axis = 0; axis < observable.size(); ++axis) {
    if (observable[axis] != observable_[axis] && time_s - agreed_s_[axis] >= kLasting_s)
      observable_[axis] = observable[axis];
    if (observable[axis] == observable_[axis]) agreed_s_[axis] = time_s;
  }
}

std::string HiddenMotions::words() const { return trial_ < 0 ? "" : describe_observability(observable_); }

}  // namespace gelslam
