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

Judgement judge_pose_error(const Pose& estimate, const Pose& truth, const std::array<bool, 6>& observable,
                           bool tracked) {
  // Both are target_T_reference: what is left between them is along the target's axes.
  const Pose gap = estimate * truth.inverse();
  Judgement judgement;
  judgement.tracked = tracked;
  judgement.error_mm = gap.translation().norm();
  judgement.error_deg = rotation_angle_rad(gap) * kDegreesPerRadian;
  const double shown_mm = largest(gap.translation(), observable.data()),
               shown_deg = largest(so3_log(gap.linear()) * kDegreesPerRadian, observable.data() + 3);
  judgement.right = judgement.error_mm < kRightMm && judgement.error_deg < kRightDeg;
  judgement.shown_right = shown_mm < kRightMm && shown_deg < kRightDeg;
  judgement.wrong = shown_mm > kWrongMm || shown_deg > kWrongDeg;
  return judgement;
}

Judgement judge_result(const RegistrationProblem& problem, const RegistrationResult& result) {
  return judge_pose_error(result.target_T_reference, problem.truth, result.observable, result.ok());
}

std::vector<IndexedPose> poses_of(const SlamMap& map, int background_frames) {
  std::vector<IndexedPose> poses;
  for (const FrameRecord& frame : map.frames)
    if (map.has_pose(frame) && frame.frame >= background_frames)
      poses.push_back({static_cast<int>(frame.frame) - background_frames,
                       map.anchor_T_keyframe(frame.keyframe) * frame.keyframe_T_frame});
  return poses;
}

}  // namespace gelslam::lab
