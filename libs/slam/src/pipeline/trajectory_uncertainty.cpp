// Uncertainty of a map's trajectory: two standard deviations of the poses, and intervals in which a motion
// was not observable. The worst twentieth of the poses does not count.

#include "gelslam/slam/trajectory_uncertainty.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <array>
#include <iterator>
#include <utility>

#include "gelslam/core/text.hpp"
#include "gelslam/core/uncertain_pose.hpp"

namespace gelslam {
namespace {

// Larger errors than these do not occur in a map whose surfaces fit each other. They mean that the image is
// mirrored, or that the gradient model belongs to another sensor.
constexpr double kImplausibleMm = 10.0, kImplausibleDeg = 90.0;

constexpr std::array<const char*, 6> kMotions = {"x", "y", "z", "rx", "ry", "rz"};

/// Returns the 95 % quantile of the poses' uncertainty, so that a faint contact of a few frames, or the
/// beginning of a touch, is not reported as drift.
RunReport::Drift large_drift(std::vector<RunReport::Drift> poses) {
  if (poses.empty()) return {};
  const auto at = std::prev(poses.end(), 1 + std::ssize(poses) / 20);
  std::ranges::nth_element(poses, at, {}, &RunReport::Drift::amount);
  return *at;
}

}  // namespace

RunReport::Uncertainty trajectory_uncertainty(const std::vector<FrameRecord>& frames,
                                              const MapSnapshot& map) {
  UnobservableMotions unobservable;
  std::vector<RunReport::Drift> mm, deg;
  for (const FrameRecord& frame : frames) {
    const MapSnapshot::Node* node = map.find(frame.keyframe);
    if (node == nullptr || !node->placed) continue;
    unobservable.pass(frame);
    const Matrix6d covariance = map.pose_of(frame)->map_T_frame.covariance;
    mm.push_back({2 * worst_sigma(covariance.bottomRightCorner<3, 3>()), frame.frame, frame.time_s});
    const double two_sigmas_deg = 2 * kDegreesPerRadian * worst_sigma(covariance.topLeftCorner<3, 3>());
    deg.push_back({std::min(180.0, two_sigmas_deg), frame.frame, frame.time_s});
  }
  return {large_drift(std::move(mm)), large_drift(std::move(deg)), unobservable.all()};
}

std::vector<std::string> describe(const RunReport::Uncertainty& uncertainty, double farthest_mm) {
  const double mm = uncertainty.drift_mm.amount, deg = uncertainty.drift_deg.amount;
  std::string amounts;
  if (mm > kLargeDriftMm) amounts = fmt::format("{:.2g} mm", mm);
  if (deg > kLargeDriftDeg) amounts += fmt::format("{}{:.0f} degrees", amounts.empty() ? "" : " and ", deg);
  if (!amounts.empty()) {
    const bool implausible = deg > kImplausibleDeg && mm > kImplausibleMm;
    const bool has_left = farthest_mm > std::max(mm, kLargeDriftMm);
    return {"poses may be off by " + amounts +
            (implausible ? ": is the picture mirrored, or the model another sensor's?"
             : !has_left ? ": press on texture"
             : uncertainty.not_observable.empty() ? ": return to where you began"
                                                  : ": return to where you began, and press on texture")};
  }
  if (uncertainty.not_observable.empty()) return {};
  std::array<bool, 6> observable = {true, true, true, true, true, true};
  std::int64_t frames = 0;
  double first_time_s = uncertainty.not_observable.front().first_time_s;
  for (const RunReport::UnobservableMotion& unobservable : uncertainty.not_observable) {
    for (std::size_t motion = 0; motion < kMotions.size(); ++motion)
      if (unobservable.motion == kMotions[motion]) observable[motion] = false;
    frames = std::max(frames, unobservable.frames);
    first_time_s = std::min(first_time_s, unobservable.first_time_s);
  }
  return {fmt::format("{} in {}, from {:.1f} s on: press on texture", describe_observability(observable),
                      counted(frames, "frame"), first_time_s)};
}

Vector6d sigma_of(const Matrix6d& rotation_first) {
  return translation_first(rotation_first).diagonal().cwiseMax(0.0).cwiseSqrt();
}

std::string describe_drift(const Vector6d& sigma) {
  constexpr double kTwoSigma = 2.0;
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
  return where.empty() ? "" : "may be off by " + where;
}

void UnobservableMotions::pass(const FrameRecord& frame) {
  if (std::exchange(trial_, frame.trial) != frame.trial)
    for (Motion& motion : motions_) motion = {.counted = motion.counted};
  for (std::size_t axis = 0; axis < motions_.size(); ++axis) {
    auto& [is_observable, differing, waiting, counted] = motions_[axis];
    const bool observable = frame.observable[axis];
    differing = observable == is_observable ? 0 : differing + 1;
    if (differing > kLastingFrames) {
      is_observable = observable;
      differing = 0;
    }
    if (observable) {
      waiting = {};
      continue;
    }
    if (waiting.frames++ == 0) waiting = {kMotions[axis], frame.frame, frame.time_s, 1};
    if (is_observable) continue;
    const std::int64_t frames = counted.frames + waiting.frames;
    if (counted.frames == 0) counted = waiting;
    counted.frames = frames;
    waiting = {};
  }
}

std::string UnobservableMotions::words() const {
  std::array<bool, 6> observable{};
  for (std::size_t axis = 0; axis < motions_.size(); ++axis) observable[axis] = motions_[axis].is_observable;
  return describe_observability(observable);
}

std::vector<RunReport::UnobservableMotion> UnobservableMotions::all() const {
  std::vector<RunReport::UnobservableMotion> found;
  for (const Motion& motion : motions_)
    if (motion.counted.frames > 0) found.push_back(motion.counted);
  return found;
}

}  // namespace gelslam
