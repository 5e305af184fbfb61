#pragma once

#include <functional>
#include <memory>
#include <vector>

#include "gelslam/backend/pose_graph.hpp"
#include "gelslam/frontend/keyframe.hpp"

namespace gelslam {

struct RefinementOptions {
  bool enabled = true;
  int rounds = 2;
  /// Keyframe pairs whose patches should overlap by at least this share of the smaller contact are
  /// registered.
  double min_overlap = 0.3;
  int max_pairs_per_keyframe = 12;
  /// Surfaces more alike to themselves than this after a shift (loop_closure/self_similarity.hpp) are
  /// registered only where the edges tell beforehand which of the places it is.
  double max_self_similarity = 0.8;
  double gradient_scale_sigma = 0.1;  ///< as in PoseGraphOptions: what is not known of the edges in common
  NormalFlowOptions registration;
};

/// Share of the smaller contact that lies on the other's, close to its height. 0 where they face away from
/// each other: opposite sides of a thin object.
double contact_overlap(const Surface& a, const Surface& b, const Pose& a_T_b);

/// Once the pose graph knows roughly where every keyframe is, registers all pairs that should overlap but
/// have no edge yet, and returns them as loop edges, or those found until `stop_requested` turns true. Null
/// keyframes are passed over. Own addition; it replaces drift along chains of keyframes by direct evidence.
std::vector<PoseGraphEdge> densify(
    const std::vector<std::shared_ptr<const Keyframe>>& keyframes, const PoseGraphSolution& solution,
    const std::vector<PoseGraphEdge>& edges, const RefinementOptions& options,
    const std::function<bool()>& stop_requested = [] { return false; });

}  // namespace gelslam
