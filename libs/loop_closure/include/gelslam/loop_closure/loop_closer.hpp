#pragma once

#include <memory>
#include <optional>
#include <vector>

#include "gelslam/backend/pose_graph.hpp"
#include "gelslam/frontend/keyframe.hpp"
#include "gelslam/registration/verification.hpp"

namespace gelslam {

struct LoopClosureOptions {
  int max_features = 300;  // Features kept per keyframe, the strongest first.
  int min_sift_inliers = 8;
  int max_candidates = 20;  // Keyframes with most votes that are then compared feature by feature.
  /// Largest number of loops per keyframe. Candidates with most inliers are tried first.
  int max_constraints = 6;  // More loops to the same place cost time and add little.
};

/// Applies verify() to two keyframes that may show the same place, starting from `older_T_newer`. Returns an
/// edge from the older to the newer keyframe, or nothing when they do not show the same surface.
std::optional<PoseGraphEdge> verify_loop(const Keyframe& older, const Keyframe& newer,
                                         const Pose& older_T_newer, const NormalFlowOptions& registration,
                                         const VerificationOptions& verification);

/// Recognizes places that were seen before by SIFT features of curvature maps, and verifies each candidate
/// (Huang et al., T-RO 2026, §V; the voting and the lift of a match to 3-D are not in the paper).
/// Deterministic. Not thread-safe.
class LoopCloser {
 public:
  explicit LoopCloser(const LoopClosureOptions& options, const NormalFlowOptions& registration = {},
                      const VerificationOptions& verification = {});
  ~LoopCloser();

  /// Searches the stored keyframes for loops with `keyframe`, then stores it for later searches, and returns
  /// the loops. The newest 12 keyframes of the same trial are not searched, because odometry links them
  /// already. Ids must be ascending; otherwise Error is thrown.
  std::vector<PoseGraphEdge> add(const Keyframe& keyframe);

  /// Stores the keyframes of a known map without a search. Ids must be ascending; otherwise Error is thrown.
  void keep(const std::vector<Keyframe>& keyframes);

  /// Searches all stored keyframes for places that `keyframe` shows, without storing it. Returns one edge for
  /// each verified place.
  std::vector<PoseGraphEdge> recognize(const Keyframe& keyframe) const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace gelslam
