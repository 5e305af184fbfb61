#pragma once

#include "gelslam/evaluation/trajectory_metrics.hpp"
#include "gelslam/registration/registration.hpp"
#include "gelslam/slam/slam_map.hpp"
#include "registration_problems.hpp"

namespace gelslam::lab {

/// From here on a pose is wrong, in every study.
inline constexpr double kWrongMm = 1.0, kWrongDeg = 5.0;

/// What an answer is worth. Errors are where the sensor truly was, seen from where it was said to be.
struct Judgement {
  double error_mm = 0, error_deg = 0;  ///< in all directions
  bool tracked = false;
  bool right = false;        ///< within 0.3 mm and 2 degrees
  bool shown_right = false;  ///< the same along every axis that was reported observable
  bool wrong = false;        ///< by more than 1 mm or 5 degrees along an axis that was reported observable

  bool silent_failure() const { return tracked && wrong; }
};

/// Counts of judgements.
struct Tally {
  int cases = 0, right = 0, shown_right = 0, tracked = 0, silent = 0;

  void add(const Judgement& judged) {
    add(Tally{1, judged.right, judged.shown_right, judged.tracked, judged.silent_failure()});
  }
  void add(const Tally& other) {
    cases += other.cases;
    right += other.right;
    shown_right += other.shown_right;
    tracked += other.tracked;
    silent += other.silent;
  }
  double share(int count) const { return cases == 0 ? 0.0 : static_cast<double>(count) / cases; }
};

Judgement judge_pose_error(const Pose& estimate, const Pose& truth, const std::array<bool, 6>& observable,
                           bool tracked);

Judgement judge_result(const RegistrationProblem& problem, const RegistrationResult& result);

/// Of the frames in the map, counted from the end of the background.
std::vector<IndexedPose> poses_of(const SlamMap& map, int background_frames);

}  // namespace gelslam::lab
