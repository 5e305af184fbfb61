#pragma once

#include <functional>
#include <memory>
#include <vector>

#include "gelslam/backend/pose_graph.hpp"
#include "gelslam/core/progress.hpp"
#include "gelslam/frontend/keyframe.hpp"
#include "gelslam/slam/slam_options.hpp"

namespace gelslam {

/// GradientScaleOptions::sigma, of the worst model among keyframes (null: none there).
double gradient_scale_sigma(const std::vector<std::shared_ptr<const Keyframe>>& keyframes,
                            const GradientScaleOptions& options);

/// Share of the smaller contact that lies on the other's, close to its height. 0 where they face away from
/// each other: opposite sides of a thin object.
double contact_overlap(const Surface& a, const Surface& b, const Pose& a_T_b);

/// Once the pose graph knows roughly where every keyframe is, verifies all pairs that should overlap but have
/// no edge yet, and returns them as loop edges, or those found until `stop_requested` turns true. Null
/// keyframes and patches are left out. Each keyframe is a step of `progress`, if there is one. Own addition;
/// it replaces drift along chains of keyframes by direct measurements.
std::vector<PoseGraphEdge> find_overlap_edges(
    const std::vector<std::shared_ptr<const Keyframe>>& keyframes, const PoseGraphSolution& solution,
    const std::vector<PoseGraphEdge>& edges, const SlamOptions& options,
    const std::function<bool()>& stop_requested = [] { return false; }, ParallelProgress* progress = nullptr);

}  // namespace gelslam
