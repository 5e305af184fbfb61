#include "judgement.hpp"

#include <algorithm>
#include <cmath>

#include "gelslam/core/se3.hpp"

namespace gelslam::lab {
namespace {

constexpr double kRightMm = 0.3, kRightDeg = 2.0;

double largest(const Eigen::Vector3d& error, const bool* observable) {
  double most = 0;
  for (int axis = 0; axis < 3; ++axis)
    if (observable[axis]) most = std::max(most, std::abs(error[axis]));
  return most;
}

}  // namespace

Tally judge_result(const RegistrationProblem& problem, const RegistrationResult& result) {
  // Both are target_T_reference, so their difference is along the target's axes.
  const Pose gap = result.target_T_reference * problem.truth.inverse();
  const bool* observable = result.observable.data();
  const double shown_mm = largest(gap.translation(), observable),
               shown_deg = largest(so3_log(gap.linear()) * kDegreesPerRadian, observable + 3);
  Tally tally{.cases = 1, .tracked = result.ok()};
  tally.right =
      gap.translation().norm() < kRightMm && rotation_angle_rad(gap) * kDegreesPerRadian < kRightDeg;
  tally.shown_right = shown_mm < kRightMm && shown_deg < kRightDeg;
  tally.undetected = result.ok() && (shown_mm > kWrongMm || shown_deg > kWrongDeg);
  return tally;
}

std::vector<IndexedPose> poses_of(const SlamMap& map, int background_frames) {
  const MapSnapshot placed = snapshot_of(map);
  std::vector<IndexedPose> poses;
  for (const FrameRecord& frame : map.frames)
    if (map.has_pose(frame) && frame.frame >= background_frames)
      poses.push_back(
          {static_cast<int>(frame.frame) - background_frames, placed.pose_of(frame)->map_T_frame.pose});
  return poses;
}

}  // namespace gelslam::lab
