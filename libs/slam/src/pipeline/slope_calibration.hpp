#pragma once

#include <functional>
#include <memory>
#include <vector>

#include "gelslam/backend/pose_graph.hpp"
#include "gelslam/frontend/keyframe.hpp"
#include "gelslam/slam/slope_calibration_options.hpp"
#include "gelslam/surface/slope_correction.hpp"

namespace gelslam::slam::detail {

/// A map whose slopes have been corrected by what its keyframes say of each other.
struct CalibratedMap {
  SlopeCorrection correction;
  std::vector<std::shared_ptr<const Keyframe>> keyframes;  ///< with corrected surfaces; null where they were
  std::vector<PoseGraphEdge> edges;                        ///< as given, registered again
  PoseGraphSolution solution;
};

/// Estimates one SlopeCorrection for all keyframes together with their poses: pairs that see one place in
/// different parts of the gel or at different tilts, and loops, tell what the slopes' model reads wrong;
/// where nothing tells it, the prior (no correction) holds, and where that is all of it the map is given back
/// as it was. Every edge is registered again on corrected surfaces, some rounds.
CalibratedMap calibrate_slopes(const std::vector<std::shared_ptr<const Keyframe>>& keyframes,
                               const std::vector<PoseGraphEdge>& edges, const PoseGraphSolution& solution,
                               const PoseGraphOptions& pose_graph, const SlopeCalibrationOptions& options,
                               const std::function<bool()>& stop_requested);

}  // namespace gelslam::slam::detail
