#pragma once

#include <memory>
#include <vector>

#include "gelslam/frontend/keyframe.hpp"
#include "gelslam/registration/normal_flow.hpp"

namespace gelslam {

struct LoopClosureOptions {
  double sift_contrast_threshold = 0.02;
  int sift_octave_layers = 3;
  int min_sift_inliers = 8;
  double ransac_threshold_px = 3.0;
  int ransac_iterations = 100;
  NormalFlowOptions registration;  ///< its scr/ccs thresholds are the gates of verification
};

/// A keyframe seen again: `from` is the older one. from_T_to maps the newer keyframe's coordinates into the older's.
struct LoopConstraint {
  int from = 0, to = 0;  ///< keyframe ids
  Pose from_T_to = Pose::Identity();
  Matrix6d information = Matrix6d::Identity();
  int sift_inliers = 0;
  double scr = 0, ccs = 0;
};

/// Recognises places by SIFT on curvature maps and verifies each by NormalFlow (Huang et al., T-RO 2026).
class LoopCloser {
 public:
  explicit LoopCloser(const LoopClosureOptions& options);
  ~LoopCloser();

  /// Compares `keyframe` with all kept keyframes except its direct predecessor in the same trial, then keeps it for
  /// later ones. Every keyframe added is searched for. Deterministic.
  std::vector<LoopConstraint> add(const Keyframe& keyframe);

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace gelslam
