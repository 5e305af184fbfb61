#pragma once

#include "gelslam/backend/pose_graph.hpp"
#include "gelslam/frontend/tracker.hpp"
#include "gelslam/fusion/fusion.hpp"
#include "gelslam/loop_closure/loop_closer.hpp"
#include "gelslam/slam/refinement.hpp"
#include "gelslam/slam/slope_calibration_options.hpp"

namespace gelslam {

/// One options struct per stage.
struct SlamOptions {
  NormalFlowOptions registration;    ///< of frames and of keyframes
  VerificationOptions verification;  ///< of every place but the next frame's
  TrackerOptions tracker;
  LoopClosureOptions loop_closure;
  PoseGraphOptions pose_graph;
  RefinementOptions refinement;
  SlopeCalibrationOptions slope_calibration;
  CoverageOptions coverage;
  FusionOptions fusion;
};

}  // namespace gelslam
