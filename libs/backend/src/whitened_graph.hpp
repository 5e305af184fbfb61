#pragma once

#include <Eigen/Geometry>
#include <array>
#include <cmath>

#include "gelslam/backend/pose_graph.hpp"

namespace gelslam::backend::detail {

/// Returns the information of an edge plus the weak prior that its frames overlap, which bounds their
/// relative pose to a radian and the sensor's width (one standard deviation each). The prior matters only
/// along directions that the surface did not show. Without it, a chain of edges along a featureless surface
/// has no unique solution.
Matrix6d with_overlap_prior(const Matrix6d& information);

/// Returns W with Wᵀ W = with_overlap_prior(information), so that the squared norm of W * error is the
/// squared Mahalanobis distance. Throws Error for information that is not finite, not symmetric or not
/// positive semi-definite.
Matrix6d whitening_matrix(const Matrix6d& information);

/// An edge in the form in which its residual is evaluated. `from` and `to` are node indices.
struct WhitenedEdge {
  int from = 0, to = 0;
  Eigen::Quaterniond rotation;
  Eigen::Vector3d translation_mm;
  Matrix6d whitening;
  EdgeKind kind = EdgeKind::odometry;
  /// Whitened 6xK derivative of the measurement with respect to the shared unknowns; 6x0 if there are none.
  Eigen::Matrix<double, 6, Eigen::Dynamic> by_unknown = Eigen::Matrix<double, 6, Eigen::Dynamic>(6, 0);
};

/// A node's pose as Ceres stores it: quaternion (x y z w), then translation in mm.
using NodeState = std::array<double, 7>;

NodeState to_state(const Pose& pose);
Pose to_pose(const NodeState& state);

/// Returns the whitened error (rx ry rz tx ty tz) of an edge: the motion between its two nodes compared with
/// the measured one, in the measured `to` frame, for shared unknowns of 0. To first order this equals the
/// SE(3) logarithm, at lower cost. The scalar type is a template parameter so that Ceres can differentiate
/// the function.
template <typename T>
Eigen::Matrix<T, 6, 1> whitened_error(const WhitenedEdge& edge, const T* from, const T* to) {
  using std::atan2, std::sqrt;
  const Eigen::Map<const Eigen::Quaternion<T>> map_R_from(from), map_R_to(to);
  const Eigen::Map<const Eigen::Matrix<T, 3, 1>> from_mm(from + 4), to_mm(to + 4);
  const Eigen::Quaternion<T> from_R_map = map_R_from.conjugate();
  const Eigen::Quaternion<T> measured_inverse = edge.rotation.conjugate().cast<T>();
  const Eigen::Quaternion<T> error = measured_inverse * (from_R_map * map_R_to);
  // q and -q are the same rotation; this takes the one with the smaller angle.
  const T sign = error.w() < T(0) ? T(-1) : T(1);
  const T sin_half_squared = error.vec().squaredNorm();
  T scale = T(2);
  if (sin_half_squared > T(1e-16)) {
    const T sin_half = sqrt(sin_half_squared);
    scale = T(2) * atan2(sin_half, sign * error.w()) / sin_half;
  }
  const Eigen::Matrix<T, 3, 1> motion_mm = from_R_map * (to_mm - from_mm);
  Eigen::Matrix<T, 6, 1> result;
  result.template head<3>() = sign * scale * error.vec();
  result.template tail<3>() = measured_inverse * (motion_mm - edge.translation_mm.cast<T>());
  return edge.whitening.cast<T>() * result;
}

/// Returns the norm of the whitened residual of an edge between two nodes. `unknowns` is empty (all are 0),
/// or has one entry per column of the edge's derivative.
double residual_norm(const WhitenedEdge& edge, const NodeState& from, const NodeState& to,
                     const Eigen::VectorXd& unknowns = {});

}  // namespace gelslam::backend::detail
