#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <vector>

#include "gelslam/core/progress.hpp"
#include "gelslam/slam/slam_map.hpp"
#include "gelslam/slam/slam_options.hpp"

namespace gelslam::slam::detail {

/// SlopeCalibrationOptions::gradient_scale_sigma of the worst model among keyframes (null: none there).
double gradient_scale_sigma(const std::vector<std::shared_ptr<const Keyframe>>& keyframes,
                            const SlopeCalibrationOptions& options);

/// A map whose slopes have been corrected by what its keyframes tell about each other.
struct CalibratedMap {
  SlopeCorrection correction;
  std::vector<std::shared_ptr<const Keyframe>> keyframes;  ///< with corrected surfaces; null where they were
  std::vector<PoseGraphEdge> edges;                        ///< of the map, registered again
  PoseGraphSolution solution;
};

/// Estimates all terms of one SlopeCorrection, starting from the map's, together with the poses: pairs of
/// keyframes that see one place in different parts of the gel or at different tilts, and loops, tell what the
/// slope model reads wrong; where nothing tells it, the prior (no correction) holds. Every edge is registered
/// again on corrected surfaces, in several rounds. Returns nothing when stopped, when the log does not tell
/// the correction, or when the result is not plausible. Tells `progress` (null: nobody) of the task
/// "calibrating slopes". `threads` 0: all cores; the result does not depend on it.
std::optional<CalibratedMap> calibrate_slopes(const SlamMap& map, const PoseGraphOptions& pose_graph,
                                              const SlopeCalibrationOptions& options,
                                              const NormalFlowOptions& normal_flow,
                                              const std::function<bool()>& stop_requested,
                                              ProgressSink* progress = nullptr, int threads = 0);

/// A frame between two keyframes was registered to the first of them with the same error of the slopes that
/// the link from it to the second has, in proportion to how much of that motion it has made: what corrected
/// surfaces put right about the link is distributed among the frames. `measured`: links as tracked,
/// `corrected`: the same registered again; other edges do not count, and frames after the last link stay as
/// they are. Source: own.
void distribute_corrections(const std::vector<PoseGraphEdge>& measured,
                            const std::vector<PoseGraphEdge>& corrected, std::vector<FrameRecord>& frames);

}  // namespace gelslam::slam::detail
