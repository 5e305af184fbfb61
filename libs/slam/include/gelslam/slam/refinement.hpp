#pragma once

#include <functional>
#include <memory>
#include <vector>

#include "gelslam/backend/pose_graph.hpp"
#include "gelslam/core/progress.hpp"
#include "gelslam/frontend/keyframe.hpp"
#include "gelslam/slam/slam_options.hpp"

namespace gelslam {

/// Returns GradientScaleOptions::sigma for the least certain gradient model among the keyframes. Entries may
/// be null.
double gradient_scale_sigma(const std::vector<std::shared_ptr<const Keyframe>>& keyframes,
                            const GradientScaleOptions& options);

/// Returns the fraction of the smaller contact that coincides with the other contact, within a tolerance of
/// height. It is 0 where the surfaces face away from each other, as on opposite sides of a thin object.
double contact_overlap(const Surface& a, const Surface& b, const Pose& a_T_b);

/// Verifies all pairs of keyframes that should overlap according to the solved pose graph but have no edge
/// yet, and returns the verified ones as loop edges. When `stop_requested` returns true, it returns those
/// found so far. Null entries and patches are skipped. `progress` (may be null) is advanced by one for each
/// keyframe. The direct measurements replace accumulated drift along chains of keyframes. Not in the paper.
std::vector<PoseGraphEdge> find_overlap_edges(
    const std::vector<std::shared_ptr<const Keyframe>>& keyframes, const PoseGraphSolution& solution,
    const std::vector<PoseGraphEdge>& edges, const SlamOptions& options,
    const std::function<bool()>& stop_requested = [] { return false; }, ParallelProgress* progress = nullptr);

}  // namespace gelslam
