#pragma once

#include "gelslam/core/uncertain_pose.hpp"

namespace gelslam {

enum class EdgeKind { odometry, loop };

/// A measured relative pose. `information` is the inverse covariance (rad, mm; order as in se3.hpp) of the
/// right perturbation: true from_T_to = from_T_to * exp(noise). It may be singular, because it
/// is 0 along a direction that was not observable. The pose graph adds the weak prior that the two frames
/// overlap (kOverlapSigmaRad, kOverlapSigmaMm in pose_graph.hpp).
struct PoseGraphEdge {
  int from = 0;
  int to = 0;
  Pose from_T_to = Pose::Identity();
  Matrix6d information = Matrix6d::Identity();
  EdgeKind kind = EdgeKind::odometry;
  /// Center of the contact that both frames show, as measured, in the `to` frame. Used by
  /// motion_by_gradient_scale().
  Eigen::Vector3d shared_center_mm = Eigen::Vector3d::Zero();
  /// A loop that alone is not sufficient evidence to join two components (consistent_edges()).
  /// solve_pose_graph() ignores this flag.
  bool tentative = false;
};

}  // namespace gelslam
