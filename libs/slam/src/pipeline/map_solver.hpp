#pragma once

#include <functional>
#include <map>
#include <vector>

#include "gelslam/backend/pose_covariance.hpp"
#include "gelslam/core/parallel.hpp"
#include "gelslam/slam/slam_map.hpp"
#include "gelslam/slam/slam_options.hpp"

// The stage "optimize" of a map: its pose graph is solved with what else its edges leave unknown, the
// gradient scale of a sensor or how two sensors are fixed to each other.
namespace gelslam::slam::detail {

inline constexpr int kOverlapRounds = 2;  // numerics: the first one's corrections show more overlaps

/// GradientScaleOptions::sigma, of the worst model among keyframes (null: none there).
double gradient_scale_sigma(const std::vector<std::shared_ptr<const Keyframe>>& keyframes,
                            const GradientScaleOptions& options);

/// Those to be kept, in the same order.
std::vector<PoseGraphEdge> chosen(const std::vector<PoseGraphEdge>& edges, const std::vector<bool>& keep);

/// Solves for all poses, and for the gradient scale if asked to.
PoseGraphSolution solve_poses(const std::map<int, Pose>& initial, const std::vector<PoseGraphEdge>& edges,
                              double scale_sigma, const SlamOptions& options);

/// Solves a map of which all edges are measured: leaves out what contradicts the others, and joins what two
/// sensors have felt at the same time, if their motions tell how they are fixed to each other.
void solve_map(SlamMap& map, const std::map<int, Pose>& initial, double scale_sigma,
               const SlamOptions& options);

/// Registers keyframes that should overlap, and solves again; in rounds.
void add_overlap_edges(SlamMap& map, double scale_sigma, const SlamOptions& options,
                       const std::function<bool()>& stop_requested, ParallelProgress& progress);

/// How well a solved map is known.
struct MapCovariances {
  std::map<int, Matrix6d> anchor_T_keyframe;
  Matrix6d rig = Matrix6d::Zero();  ///< RigPose::covariance, if there is a rig
};
MapCovariances assess_map(const SlamMap& map, int anchor, double scale_sigma, const SlamOptions& options);

/// What two sensors have felt at the same time as loops, by the rig that was found, for a record that says
/// nothing of a rig: those of another scan may be fixed otherwise. One of each pair of keyframes, for
/// neighbors in time share their errors. Together they are as uncertain as that rig.
std::vector<PoseGraphEdge> loops_of_rig(const std::vector<RigConstraint>& constraints, const RigPose& rig);

/// The edges that were solved: the map's, then those of the rig if it is known.
std::vector<PoseGraphEdge> with_rig_edges(const SlamMap& map, std::vector<PoseGraphEdge> edges);

}  // namespace gelslam::slam::detail
