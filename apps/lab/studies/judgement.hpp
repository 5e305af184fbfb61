#pragma once

#include "gelslam/evaluation/trajectory_metrics.hpp"
#include "gelslam/registration/registration.hpp"
#include "gelslam/slam/slam_map.hpp"
#include "registration_problems.hpp"

namespace gelslam::lab {

/// Beyond these errors a pose counts as wrong, in all studies.
inline constexpr double kWrongMm = 1.0, kWrongDeg = 5.0;

/// Numbers of results by quality.
struct Tally {
  int cases = 0;
  int right = 0;        ///< Within 0.3 mm and 2 degrees.
  int shown_right = 0;  ///< The same, but only along the axes reported as observable.
  int tracked = 0;
  int undetected = 0;  ///< Accepted, but off by more than 1 mm or 5 degrees along such an axis.

  void add(const Tally& other) {
    cases += other.cases;
    right += other.right;
    shown_right += other.shown_right;
    tracked += other.tracked;
    undetected += other.undetected;
  }
  double share(int count) const { return cases == 0 ? 0.0 : static_cast<double>(count) / cases; }
};

/// Judges one result.
Tally judge_result(const RegistrationProblem& problem, const RegistrationResult& result);

/// Returns the poses of the frames in the map; frames are counted from the end of the background.
std::vector<IndexedPose> poses_of(const SlamMap& map, int background_frames);

}  // namespace gelslam::lab
