#include "gelslam/backend/gradient_scale.hpp"

namespace gelslam {
namespace {

/// What the edge would measure with slopes corrected by these factors.
Pose corrected_motion(const PoseGraphEdge& edge, const Eigen::Vector2d& factor) {
  constexpr double kUpsideDown = 1e-6;  // there the split into tilt and twist is not defined
  const Eigen::Quaterniond q(edge.from_T_to.linear());
  Eigen::Quaterniond twist(q.w(), 0, 0, q.z());
  twist = twist.norm() > kUpsideDown ? twist.normalized() : Eigen::Quaterniond::Identity();
  const Eigen::Vector3d tilt = so3_log((q * twist.conjugate()).toRotationMatrix());
  const Eigen::Vector3d tilt_scale(1.0 - factor.y(), 1.0 - factor.x(), 1.0);
  const Eigen::Vector3d depth_scale(1.0, 1.0, 1.0 - factor.mean());

  const Eigen::Vector3d center_in_from = edge.from_T_to * edge.shared_center_mm;
  Pose corrected = Pose::Identity();
  corrected.linear() = so3_exp(tilt.cwiseProduct(tilt_scale)) * twist.toRotationMatrix();
  corrected.translation() = center_in_from.cwiseProduct(depth_scale) -
                            corrected.linear() * edge.shared_center_mm.cwiseProduct(depth_scale);
  return corrected;
}

}  // namespace

Eigen::Matrix<double, 6, 2> motion_by_gradient_scale(const PoseGraphEdge& edge) {
  constexpr double kStep = 1e-3;
  Eigen::Matrix<double, 6, 2> result;
  for (int axis = 0; axis < 2; ++axis) {
    const Eigen::Vector2d step = kStep * Eigen::Vector2d::Unit(axis);
    const Pose before = corrected_motion(edge, -step), after = corrected_motion(edge, step);
    result.col(axis) = se3_log(before.inverse() * after) / (2 * kStep);
  }
  return result;
}

SharedUnknowns gradient_scale_unknowns(const std::vector<PoseGraphEdge>& edges, double sigma) {
  SharedUnknowns shared;
  shared.edge_by_unknown.reserve(edges.size());
  for (const PoseGraphEdge& edge : edges) shared.edge_by_unknown.push_back(motion_by_gradient_scale(edge));
  shared.information = Eigen::Matrix2d::Identity() / (sigma * sigma);
  shared.mean = Eigen::Vector2d::Zero();
  return shared;
}

}  // namespace gelslam
