#pragma once

#include <cmath>
#include <vector>

#include "gelslam/core/trajectory.hpp"

namespace gelslam::exchange::detail {

/// To a nanometer: short in text.
inline double meters(double mm) { return std::round(mm * 1e6) / 1e9; }

/// Places of the sensor, mm, cut where tracking was lost for more than a quarter of a second.
inline std::vector<std::vector<Eigen::Vector3d>> strips(const std::vector<StampedPose>& trajectory) {
  constexpr double kGapS = 0.25;
  std::vector<std::vector<Eigen::Vector3d>> result;
  double last_s = 0;
  for (const StampedPose& pose : trajectory) {
    if (result.empty() || pose.time_s - last_s > kGapS) result.emplace_back();
    result.back().push_back(pose.map_T_sensor.translation());
    last_s = pose.time_s;
  }
  return result;
}

}  // namespace gelslam::exchange::detail
