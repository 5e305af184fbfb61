#pragma once

#include <array>

#include "edge_model.hpp"
#include "gelslam/backend/pose_graph.hpp"

namespace gelslam::backend::detail {

/// W with W' W = information, so that the squared norm of W * error is the Mahalanobis distance. Directions
/// that know less than one radian and one sensor width (20 mm) are raised to that, and no others: without it
/// a chain of edges along a featureless surface has no solution. Throws Error on information that is not
/// finite, not symmetric or not positive semi-definite.
Matrix6d whitening_matrix(const Matrix6d& information);

/// An edge made ready for evaluation, nodes by index.
struct WhitenedEdge {
  int from = 0, to = 0;
  Eigen::Quaterniond rotation;
  Eigen::Vector3d translation_mm;
  Matrix6d whitening;
  EdgeKind kind = EdgeKind::odometry;
  Eigen::Vector3d shared_center_mm = Eigen::Vector3d::Zero();
  /// whitened
  Eigen::Matrix<double, 6, Eigen::Dynamic> by_unknown = Eigen::Matrix<double, 6, Eigen::Dynamic>(6, 0);
};

/// A node's state as Ceres sees it: quaternion (x y z w), then translation in mm.
using NodeState = std::array<double, 7>;

/// gradient scales along x and y as Ceres sees them.
using GainState = std::array<double, 2>;

NodeState to_state(const Pose& pose);
Pose to_pose(const NodeState& state);

template <typename T>
Motion<T> motion_of(const T* state) {
  return {Eigen::Quaternion<T>(state[3], state[0], state[1], state[2]),
          Eigen::Matrix<T, 3, 1>(state[4], state[5], state[6])};
}

template <typename T>
Eigen::Matrix<T, 6, 1> whitened_error(const WhitenedEdge& edge, const T* from, const T* to, const T* gain) {
  const Motion<T> predicted =
      as_measured(relative_motion(motion_of(from), motion_of(to)), edge.shared_center_mm, gain);
  return edge.whitening.cast<T>() * motion_error(edge.rotation, edge.translation_mm, predicted);
}

/// Whitened residual norm of an edge between two nodes, as if shared unknowns were 0.
double residual_norm(const WhitenedEdge& edge, const NodeState& from, const NodeState& to,
                     const GainState& gain);
/// The same with `unknowns`, as many as the edge has columns for, or more.
double residual_norm(const WhitenedEdge& edge, const NodeState& from, const NodeState& to,
                     const GainState& gain, const Eigen::VectorXd& unknowns);

/// Ceres functors. Most solves do not estimate the gain, and then its derivative is not computed.
struct EdgeResidual {
  WhitenedEdge edge;

  template <typename T>
  bool operator()(const T* from, const T* to, T* residual) const {
    Eigen::Map<Eigen::Matrix<T, 6, 1>> r(residual);
    r = edge.whitening.cast<T>() *
        motion_error(edge.rotation, edge.translation_mm, relative_motion(motion_of(from), motion_of(to)));
    return true;
  }
};

struct EdgeWithGainResidual {
  WhitenedEdge edge;

  template <typename T>
  bool operator()(const T* from, const T* to, const T* gain, T* residual) const {
    Eigen::Map<Eigen::Matrix<T, 6, 1>> r(residual);
    r = whitened_error(edge, from, to, gain);
    return true;
  }
};

struct GainPriorResidual {
  double sigma;

  template <typename T>
  bool operator()(const T* gain, T* residual) const {
    residual[0] = (gain[0] - 1.0) / sigma;
    residual[1] = (gain[1] - 1.0) / sigma;
    return true;
  }
};

}  // namespace gelslam::backend::detail
