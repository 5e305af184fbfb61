#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "gelslam/core/se3.hpp"

namespace gelslam {

/// One line of a trajectory file: the sensor's pose in the map at a time since the log's first frame.
struct StampedPose {
  double time_s = 0.0;
  Pose map_T_sensor = Pose::Identity();
};

/// Reads a TUM trajectory: lines of `time_s x y z qx qy qz qw`, meters, blank lines and lines with `#`
/// skipped. Translations come back in millimeters. Throws Error, naming file and line, when the file cannot
/// be read, a line has not eight finite numbers, a quaternion is not of unit length (within 1 %), or times do
/// not increase.
std::vector<StampedPose> read_tum(const std::filesystem::path& path);

/// One line of a TUM trajectory, with line end: "time_s tx ty tz qx qy qz qw", meters, 12 significant digits,
/// qw >= 0.
std::string tum_line(double time_s, const Pose& pose_mm);

/// The text of a file.
std::string tum_text(const std::vector<StampedPose>& trajectory);

}  // namespace gelslam
