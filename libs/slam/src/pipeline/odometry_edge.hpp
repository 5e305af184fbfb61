#pragma once

#include "gelslam/backend/pose_graph.hpp"
#include "gelslam/frontend/keyframe.hpp"

namespace gelslam::slam::detail {

/// What a link to an earlier keyframe says, for the node `to`.
inline PoseGraphEdge odometry_edge(const KeyframeLink& link, int to) {
  return {link.previous->id,    to, link.previous_T_this, link.information, EdgeKind::odometry,
          link.shared_center_mm};
}

}  // namespace gelslam::slam::detail
