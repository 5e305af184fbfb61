#include "gelslam/slam/trajectory_uncertainty.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <array>
#include <utility>

#include "gelslam/core/text.hpp"

namespace gelslam {
namespace {

// Where surfaces fit each other at all, no pose is known this badly.
constexpr double kSenselessMm = 10.0, kSenselessDeg = 90.0;  // message

constexpr std::array<const char*, 6> kMotions = {"x", "y", "z", "rx", "ry", "rz"};  // layout

void keep_worse(RunReport::Drift& worst, double amount, const FrameRecord& frame) {
  if (worst.frame < 0 || amount > worst.amount) worst = {amount, frame.frame, frame.time_s};
}

/// Counts the frames of stretches in which a motion was not observable, once these have lasted.
class HiddenFrames {
 public:
  void pass(const FrameRecord& frame) {
    if (std::exchange(trial_, frame.trial) != frame.trial) waiting_ = {};
    motions_.pass(frame.trial, frame.observable);
    for (std::size_t motion = 0; motion < kMotions.size(); ++motion) {
      Hidden& waiting = waiting_[motion];
      if (frame.observable[motion]) {
        waiting = {};
        continue;
      }
      if (waiting.frames++ == 0) {
        waiting.first_frame = frame.frame;
        waiting.first_time_s = frame.time_s;
      }
      if (motions_.observable()[motion]) continue;
      Hidden& counted = counted_[motion];
      if (counted.frames == 0)
        counted = waiting;
      else
        counted.frames += waiting.frames;
      waiting = {};
    }
  }

  std::vector<RunReport::Hidden> all() const {
    std::vector<Hidden> found;
    for (std::size_t motion = 0; motion < kMotions.size(); ++motion) {
      if (counted_[motion].frames == 0) continue;
      found.push_back(counted_[motion]);
      found.back().motion = kMotions[motion];
    }
    return found;
  }

 private:
  using Hidden = RunReport::Hidden;

  int trial_ = -1;
  HiddenMotions motions_;
  std::array<Hidden, kMotions.size()> waiting_, counted_;
};

}  // namespace

RunReport::Uncertainty trajectory_uncertainty(const std::vector<FrameRecord>& frames,
                                              const MapSnapshot& map) {
  RunReport::Uncertainty result;
  HiddenFrames hidden;
  for (const FrameRecord& frame : frames) {
    const MapSnapshot::Node* node = map.find(frame.keyframe);
    if (node == nullptr || !node->placed) continue;
    hidden.pass(frame);
    const Matrix6d covariance = map.pose_of(frame)->map_T_frame.covariance;
    keep_worse(result.drift_mm, 2 * worst_sigma(covariance.bottomRightCorner<3, 3>()), frame);
    keep_worse(result.drift_deg,
               std::min(180.0, 2 * kDegreesPerRadian * worst_sigma(covariance.topLeftCorner<3, 3>())), frame);
  }
  result.not_observable = hidden.all();
  return result;
}

std::vector<std::string> describe(const RunReport::Uncertainty& uncertainty) {
  const double mm = uncertainty.drift_mm.amount, deg = uncertainty.drift_deg.amount;
  std::string amounts;
  if (mm > kLargeDriftMm) amounts = fmt::format("{:.2g} mm", mm);
  if (deg > kLargeDriftDeg) amounts += fmt::format("{}{:.0f} degrees", amounts.empty() ? "" : " and ", deg);
  if (!amounts.empty()) {
    const bool senseless = deg > kSenselessDeg && mm > kSenselessMm;
    return {"poses may be off by " + amounts +
            (senseless ? ": is the picture mirrored, or the model another sensor's?"
                       : ": return to where you began") +
            (senseless || uncertainty.not_observable.empty() ? "" : ", and press on texture")};
  }
  if (uncertainty.not_observable.empty()) return {};
  std::array<bool, kMotions.size()> observable;
  observable.fill(true);
  std::int64_t frames = 0;
  double first_time_s = uncertainty.not_observable.front().first_time_s;
  for (const RunReport::Hidden& hidden : uncertainty.not_observable) {
    for (std::size_t motion = 0; motion < kMotions.size(); ++motion)
      if (hidden.motion == kMotions[motion]) observable[motion] = false;
    frames = std::max(frames, hidden.frames);
    first_time_s = std::min(first_time_s, hidden.first_time_s);
  }
  return {fmt::format("{} in {}, from {:.1f} s on: press on texture", describe_observability(observable),
                      counted(frames, "frame"), first_time_s)};
}

Matrix6d translation_first(const Matrix6d& rotation_first) {
  Matrix6d covariance;
  covariance << rotation_first.bottomRightCorner<3, 3>(), rotation_first.bottomLeftCorner<3, 3>(),
      rotation_first.topRightCorner<3, 3>(), rotation_first.topLeftCorner<3, 3>();
  return covariance;
}

Vector6d sigma_of(const Matrix6d& rotation_first) {
  return translation_first(rotation_first).diagonal().cwiseMax(0.0).cwiseSqrt();
}

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
  return where.empty() ? "" : "may be off by " + where;
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
