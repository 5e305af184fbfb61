#pragma once

#include <map>
#include <string>
#include <vector>

#include "gelslam/core/run_report.hpp"
#include "gelslam/core/se3.hpp"
#include "gelslam/slam/scan_record.hpp"

namespace gelslam {

/// How far the poses of a finished map may be off, by the optimized graph, whose loops reduce it: of the
/// frames whose keyframe is in the map (`in_map`, by id). `anchor_T_keyframe`: covariances of the keyframes'
/// poses (pose_covariances()). What was not observable for a while (HiddenMotions), by motion.
RunReport::Uncertainty trajectory_uncertainty(const std::vector<FrameRecord>& frames,
                                              const std::vector<bool>& in_map,
                                              const std::map<int, Matrix6d>& anchor_T_keyframe);

/// "poses may be off by 1.6 mm and 6 degrees: return to where you began" where the drift is large
/// (kLargeDriftMm) and the sensor was farther from the map's origin (`farthest_mm`) than that, else what was not observable: "twisting is not observable in 10 frames, from 0.4 s on:
/// press on texture". At most one sentence.
std::vector<std::string> describe(const RunReport::Uncertainty& uncertainty, double farthest_mm);

}  // namespace gelslam
