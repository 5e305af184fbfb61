#pragma once

#include <string>
#include <vector>

#include "gelslam/core/trajectory.hpp"

namespace gelslam {

/// One line of a TUM trajectory, with line end: "time_s tx ty tz qx qy qz qw", metres, 12 significant digits,
/// qw >= 0.
std::string tum_line(double time_s, const Pose& pose_mm);

/// The text of a file.
std::string tum_text(const std::vector<StampedPose>& trajectory);

}  // namespace gelslam
