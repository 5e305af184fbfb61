#include "gelslam/slam/trajectory_uncertainty.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <array>
#include <utility>

#include "gelslam/core/text.hpp"
#include "gelslam/slam/trial_drift.hpp"

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
                                              const std::vector<bool>& in_map,
                                              const std::map<int, Matrix6d>& anchor_T_keyframe) {
  RunReport::Uncertainty result;
  HiddenFrames hidden;
  for (const FrameRecord& frame : frames) {
    if (frame.keyframe < 0 || !in_map[static_cast<std::size_t>(frame.keyframe)]) continue;
    hidden.pass(frame);
    const Matrix6d& covariance = anchor_T_keyframe.at(frame.keyframe);
    keep_worse(result.drift_mm, 2 * worst_sigma(covariance.bottomRightCorner<3, 3>()), frame);
    keep_worse(result.drift_deg,
               std::min(180.0, 2 * kDegreesPerRadian * worst_sigma(covariance.topLeftCorner<3, 3>())), frame);
  }
  result.not_observable = hidden.all();
  return result;
}

std::vector<std::string> describe(const RunReport::Uncertainty& uncertainty, double farthest_mm) {
  const double mm = uncertainty.drift_mm.amount, deg = uncertainty.drift_deg.amount;
  std::string amounts;
  if (mm > kLargeDriftMm) amounts = fmt::format("{:.2g} mm", mm);
  if (deg > kLargeDriftDeg) amounts += fmt::format("{}{:.0f} degrees", amounts.empty() ? "" : " and ", deg);
  if (!amounts.empty()) {
    const bool senseless = deg > kSenselessDeg && mm > kSenselessMm;
    const bool has_left = farthest_mm > std::max(mm, kLargeDriftMm);
    return {"poses may be off by " + amounts +
            (senseless   ? ": is the picture mirrored, or the model another sensor's?"
             : !has_left ? ": press on texture"
             : uncertainty.not_observable.empty() ? ": return to where you began"
                                                  : ": return to where you began, and press on texture")};
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

}  // namespace gelslam
