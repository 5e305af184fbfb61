#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <vector>

#include "gelslam/slam/slam_map.hpp"
#include "gelslam/slam/slope_calibration_options.hpp"

namespace gelslam::slam::detail {

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
/// the correction, or when the result is not plausible.
std::optional<CalibratedMap> calibrate_slopes(const SlamMap& map, const PoseGraphOptions& pose_graph,
                                              const SlopeCalibrationOptions& options,
                                              const std::function<bool()>& stop_requested);

}  // namespace gelslam::slam::detail
