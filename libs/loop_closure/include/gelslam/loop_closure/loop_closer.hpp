#pragma once

#include <memory>
#include <optional>
#include <vector>

#include "gelslam/backend/pose_graph.hpp"
#include "gelslam/frontend/keyframe.hpp"
#include "gelslam/registration/verification.hpp"

namespace gelslam {

struct LoopClosureOptions {
  int max_features = 300;  // per keyframe, the strongest
  int min_sift_inliers = 8;
  int max_candidates = 20;  // keyframes that are compared feature by feature, after voting
  /// The most loops per keyframe; the most alike are taken first.
  int max_constraints = 6;  // more loops to one place cost time and add little
};

/// Applies verify() between two keyframes that may show one place, and returns an edge from the older one, or
/// nothing when they do not show the same surface.
std::optional<PoseGraphEdge> verify_loop(const Keyframe& older, const Keyframe& newer,
                                         const Pose& older_T_newer, const NormalFlowOptions& registration,
                                         const VerificationOptions& verification);

/// Recognizes places by SIFT on curvature maps and verifies each candidate (Huang et al., T-RO 2026, §V;
/// voting and the lift to 3-D are our own). Deterministic. Not thread-safe.
class LoopCloser {
 public:
  explicit LoopCloser(const LoopClosureOptions& options, const NormalFlowOptions& registration = {},
                      const VerificationOptions& verification = {});
  ~LoopCloser();

  /// Compares `keyframe` with the kept keyframes, but not with the last 12 of its own trial, which belong to
  /// the same touch; then keeps it for later ones. Every keyframe added is searched for. Ids must grow.
  std::vector<PoseGraphEdge> add(const Keyframe& keyframe);

  /// Keeps the keyframes of a map that is known already, without a search. Ids must grow.
  void keep(const std::vector<Keyframe>& keyframes);

  /// Compares `keyframe` with all kept keyframes and keeps nothing: all places of a known map that it shows.
  std::vector<PoseGraphEdge> recognize(const Keyframe& keyframe) const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace gelslam
