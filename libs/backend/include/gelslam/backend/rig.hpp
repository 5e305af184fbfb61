#pragma once

#include <optional>
#include <vector>

#include "gelslam/backend/pose_graph.hpp"

namespace gelslam {

/// What two sensors that are fixed to each other measure at one instant: each knows its pose in a keyframe of
/// its own. Covariances are those of right perturbations (rad, mm; order as in se3.hpp).
struct RigConstraint {
  int first_keyframe = 0, second_keyframe = 0;  ///< nodes of the pose graph
  Pose first_keyframe_T_sensor = Pose::Identity(), second_keyframe_T_sensor = Pose::Identity();
  Matrix6d first_covariance = Matrix6d::Zero(), second_covariance = Matrix6d::Zero();
};

/// The pose of the second sensor in the first sensor's frame, with the covariance of its right perturbation.
struct RigPose {
  Pose first_T_second = Pose::Identity();
  Matrix6d covariance = Matrix6d::Zero();
};

/// The pose that explains the motions of both sensors (A X = Z B for every pair of components), as a start
/// for solve_with_rig(): by least squares from 24 rotations that lie all around. Nothing where the
/// constraints are fewer than three. `solution`: of the graph without constraints. Source: own; the problem
/// is that of hand-eye calibration (Tsai & Lenz 1989).
std::optional<Pose> rig_from_motions(const std::vector<RigConstraint>& constraints,
                                     const PoseGraphSolution& solution);

/// Each constraint as an edge of the pose graph, if the second sensor has this pose.
std::vector<PoseGraphEdge> rig_edges(const std::vector<RigConstraint>& constraints,
                                     const Pose& first_T_second);

/// What is known of a rig besides the constraints.
struct RigPrior {
  const RigPose* known = nullptr;  ///< null: hardly anything
  /// The smallest node of the second sensor, whose nodes follow those of the first.
  int first_of_second = 0;
  double scale_sigma = 0;  ///< of the gradient scale of either sensor; 0: the scales are no unknowns
};

/// How the edges depend on a right perturbation of first_T_second, then, if these are unknown, on the
/// gradient scales of the first and the second sensor (kScaleTerms each). `edges`: of either sensor, or loops
/// between them, which are taken as independent of scales; those of rig_edges() follow.
SharedUnknowns rig_unknowns(const std::vector<PoseGraphEdge>& edges,
                            const std::vector<RigConstraint>& constraints, const Pose& first_T_second,
                            const RigPrior& prior);

struct RigSolution {
  Pose first_T_second = Pose::Identity();
  std::vector<PoseGraphEdge> edges;  ///< rig_edges() at that pose
  PoseGraphSolution graph;           ///< of the given edges, then these
};

/// Poses of all nodes and of the second sensor in the first. `solution`: of the edges without constraints,
/// which tells the components that the constraints join. Throws Error as solve_pose_graph(). Source: own.
RigSolution solve_with_rig(const PoseGraphSolution& solution, const std::vector<PoseGraphEdge>& edges,
                           const std::vector<RigConstraint>& constraints, const Pose& first_T_second,
                           const RigPrior& prior, const PoseGraphOptions& options);

}  // namespace gelslam
