#pragma once

#include "gelslam/evaluation/trajectory_metrics.hpp"
#include "gelslam/registration/registration.hpp"
#include "gelslam/slam/slam_map.hpp"
#include "registration_problems.hpp"

namespace gelslam::lab {

/// From here on a pose is wrong, in every study.
inline constexpr double kWrongMm = 1.0, kWrongDeg = 5.0;

/// What answers are worth: how many of them are.
struct Tally {
  int cases = 0;
  int right = 0;        ///< within 0.3 mm and 2 degrees
  int shown_right = 0;  ///< the same along every axis that was reported observable
  int tracked = 0;
  int undetected = 0;  ///< tracked, but off by more than 1 mm or 5 degrees along such an axis

  void add(const Tally& other) {
    cases += other.cases;
    right += other.right;
    shown_right += other.shown_right;
    tracked += other.tracked;
    undetected += other.undetected;
  }
  double share(int count) const { return cases == 0 ? 0.0 : static_cast<double>(count) / cases; }
};

/// Of one answer.
Tally judge_result(const RegistrationProblem& problem, const RegistrationResult& result);

/// Of the frames in the map, counted from the end of the background.
std::vector<IndexedPose> poses_of(const SlamMap& map, int background_frames);

}  // namespace gelslam::lab
