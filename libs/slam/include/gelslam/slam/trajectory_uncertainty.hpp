#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <vector>

#include "gelslam/core/se3.hpp"
#include "gelslam/slam/scan_record.hpp"

namespace gelslam {

/// How far the poses of a finished map may be off, by the optimized graph, whose loops reduce it.
struct TrajectoryUncertainty {
  /// Two standard deviations of anchor_T_keyframe in its worst direction, at the keyframe that is known
  /// worst.
  struct Drift {
    double amount = 0;  ///< mm, or degrees (at most 180)
    std::int64_t frame = -1;
    double time_s = 0;
  };
  /// A motion of the sensor that was not observable for a while (HiddenMotions).
  struct Hidden {
    std::size_t motion = 0;        ///< as RegistrationResult::observable
    std::int64_t first_frame = 0;  ///< in which it was not
    double first_time_s = 0;
    std::int64_t frames = 0;  ///< in which it was not
  };
  Drift mm, deg;
  std::vector<Hidden> hidden;  ///< by motion
};

/// The uncertainty of the frames whose keyframe is in the map (`in_map`, by id). `anchor_T_keyframe`:
/// covariances of the keyframes' poses (pose_covariances()).
TrajectoryUncertainty trajectory_uncertainty(const std::vector<FrameRecord>& frames,
                                             const std::vector<bool>& in_map,
                                             const std::map<int, Matrix6d>& anchor_T_keyframe);

/// "poses may be off by 1.6 mm and 6 degrees: return to where you began" where the drift is large
/// (kLargeDriftMm), else what was not observable: "twisting is not observable in 10 frames, from 0.4 s on:
/// press on texture". At most one sentence.
std::vector<std::string> describe(const TrajectoryUncertainty& uncertainty);

}  // namespace gelslam
