#pragma once

#include "gelslam/backend/pose_graph.hpp"
#include "gelslam/frontend/tracker.hpp"
#include "gelslam/fusion/fusion.hpp"
#include "gelslam/loop_closure/loop_closer.hpp"

namespace gelslam {

struct RefinementOptions {
  int max_pairs_per_keyframe = 12;  // those that overlap most; 0: no refinement
};

struct GradientScaleOptions {
  bool estimate = true;  ///< from loops, while the scan goes on and at its end
  double sigma = 0.1;    ///< prior of read slope over true slope, about 1
};

/// One options struct per stage.
struct SlamOptions {
  NormalFlowOptions registration;    ///< of frames and of keyframes
  VerificationOptions verification;  ///< of every place but the next frame's
  TrackerOptions tracker;
  LoopClosureOptions loop_closure;
  PoseGraphOptions pose_graph;
  RefinementOptions refinement;
  GradientScaleOptions gradient_scale;
  FusionOptions fusion;
};

}  // namespace gelslam
