#pragma once

#include <filesystem>
#include <memory>
#include <vector>

#include "gelslam/sensor/raw_frame.hpp"
#include "gelslam/slam/live_slam.hpp"

namespace gelslam {

struct LiveRigOptions {
  std::filesystem::path run_folder;  ///< of the one map; the sensors' own are RUN-first and RUN-second
  bool overwrite = false;
  std::filesystem::path rig;  ///< rig.yaml, or a run; empty: the motions tell
  bool continued = false;     ///< the map goes on from the run in `run_folder` (MergeRequest::in_place)
};

/// RUN-first or RUN-second; RUN of a single sensor.
std::filesystem::path run_of_sensor(const std::filesystem::path& run_folder, int sensor, int sensors);

/// A live scan of one sensor (LiveSlam; `rig` is not used), or of two that are fixed to each other. Starts at
/// once. Each of two has a run folder of its own (`options`: run_of_sensor()), so that one goes on when the
/// other is lost; frames of both count their time from one start. The second one's map is shown in that of
/// the first as soon as it is known how they are fixed. At the end merge_scans() makes one map of what both
/// have saved; where that cannot be, wait() throws, and what each has saved stays. Throws Error like
/// LiveSlam.
std::unique_ptr<LiveSession> begin_live(RawFrameSources sources, const std::vector<LiveOptions>& options,
                                        const LiveRigOptions& rig);

}  // namespace gelslam
