#pragma once

#include "gelslam/backend/pose_graph.hpp"
#include "gelslam/frontend/tracker.hpp"
#include "gelslam/fusion/fusion.hpp"
#include "gelslam/loop_closure/loop_closer.hpp"

namespace gelslam {

struct RefinementOptions {
  int max_pairs_per_keyframe = 12;  // The pairs with the largest overlap are taken; 0 turns refinement off.
};

struct GradientScaleOptions {
  bool estimate = true;  ///< Estimated from loops, during the scan and at its end.
  double sigma = 0.1;    ///< Prior standard deviation of the ratio of read to true slope, whose mean is 1.
};

/// One options struct per stage.
struct SlamOptions {
  NormalFlowOptions registration;    ///< For frames and for keyframes.
  VerificationOptions verification;  ///< For every candidate pose except that of the next tracked frame.
  TrackerOptions tracker;
  LoopClosureOptions loop_closure;
  PoseGraphOptions pose_graph;
  RefinementOptions refinement;
  GradientScaleOptions gradient_scale;
  FusionOptions fusion;
};

}  // namespace gelslam
