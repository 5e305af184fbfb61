#include "gelslam/slam/trial_drift.hpp"

#include <fmt/core.h>

#include "gelslam/core/se3.hpp"
#include "gelslam/slam/slam_map.hpp"

namespace gelslam {

namespace {

/// With what large turns do to the translation: the frame lies off by V(w) p of its perturbation (w, p), to
/// second order p + w x p / 2. A ball that was rolled without its turning being seen is off along z as well,
/// although to first order z was read. The moments are those of a normal distribution.
Matrix6d with_second_order(Matrix6d covariance) {
  const Matrix6d first = covariance;
  const auto moment = [&first](int a, int b, int c, int d) {
    return first(a, b) * first(c, d) + first(a, c) * first(b, d) + first(a, d) * first(b, c);
  };
  for (int axis = 0; axis < 3; ++axis) {
    const int w1 = (axis + 1) % 3, w2 = (axis + 2) % 3, p1 = 3 + w1, p2 = 3 + w2;
    covariance(3 + axis, 3 + axis) +=
        0.25 * (moment(w1, w1, p2, p2) + moment(w2, w2, p1, p1) - 2 * moment(w1, w2, p1, p2));
  }
  return covariance;
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
        added.edge ? compose(trial_T_keyframes_.at(added.edge->from), uncertain_motion(*added.edge))
                   : UncertainMotion();
  }
  if (frame.status != TrackStatus::tracked) return std::nullopt;
  UncertainMotion motion = trial_T_keyframes_.at(frame.keyframe->id);
  if (frame.keyframe->frame != frame.frame)
    motion = compose(motion, uncertain_motion(odometry_edge(frame.keyframe->id, -1, frame.registration)));
  return translation_first(with_second_order(
      motion.total_covariance(gradient_scale_sigma_ * frame.keyframe->surface.facts().model_sigma)));
}

Matrix6d translation_first(const Matrix6d& rotation_first) {
  Matrix6d covariance;
  covariance << rotation_first.bottomRightCorner<3, 3>(), rotation_first.bottomLeftCorner<3, 3>(),
      rotation_first.topRightCorner<3, 3>(), rotation_first.topLeftCorner<3, 3>();
  return covariance;
}

Vector6d sigma_of(const Matrix6d& covariance) { return covariance.diagonal().cwiseMax(0.0).cwiseSqrt(); }

std::string describe_drift(const Vector6d& sigma) {
  constexpr double kTwoSigma = 2.0;  // message
  constexpr std::array<const char*, 3> kAxes = {"x", "y", "z"};
  std::string where;
  const auto add = [&](const std::string& amount, const char* preposition, std::size_t axis) {
    where += fmt::format("{}{} {} {}", where.empty() ? "" : ", ", amount, preposition, kAxes[axis]);
  };
  for (std::size_t axis = 0; axis < 3; ++axis)
    if (const double mm = kTwoSigma * sigma[static_cast<int>(axis)]; mm > kLargeDriftMm)
      add(fmt::format("{:.1f} mm", mm), "along", axis);
  for (std::size_t axis = 0; axis < 3; ++axis)
    if (const double deg = kTwoSigma * kDegreesPerRadian * sigma[static_cast<int>(axis) + 3];
        deg > kLargeDriftDeg)
      add(fmt::format("{:.0f} degrees", deg), "about", axis);
  return where.empty() ? "" : "may be off by " + where + " since the trial began";
}

void HiddenMotions::pass(int trial, const std::array<bool, 6>& observable) {
  if (trial != trial_) {
    trial_ = trial;
    observable_.fill(true);
    differing_.fill(0);
  }
  for (std::size_t axis = 0; axis < observable.size(); ++axis) {
    if (observable[axis] != observable_[axis] && ++differing_[axis] > kLastingFrames)
      observable_[axis] = observable[axis];
    if (observable[axis] == observable_[axis]) differing_[axis] = 0;
  }
}

std::string HiddenMotions::words() const { return trial_ < 0 ? "" : describe_observability(observable_); }

}  // namespace gelslam
