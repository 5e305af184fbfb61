// Motions with covariances. This file also computes how a measured motion depends on the gradient scale,
// which has four factors, and decides whether a pose graph estimates these. Not in the paper.
//
// A motion's rotation is R = exp(tilt) * twist, with a twist about z and a tilt about an axis in the x-y
// plane. A tilt is measured as a difference of slopes, and is therefore scaled like them; a twist is not. If
// the tilt changes by d, R is multiplied from the right by exp(twist⁻¹ J_r(tilt) d), where J_r is the right
// Jacobian of SO(3). The translation changes so that the center of the shared contact stays the same point
// in both frames, while its depth in each frame is multiplied by 1 - (xx + yy) / 2.

#include "gelslam/backend/uncertain_motion.hpp"

#include <array>
#include <map>

#include "gelslam/core/error.hpp"
#include "gelslam/core/index.hpp"
#include "gelslam/core/sensor_optics.hpp"
#include "motion_forest.hpp"
#include "whitened_graph.hpp"

namespace gelslam {

using namespace backend::detail;

ScaleCovariance prior_scale_covariance(double sigma) {
  const Eigen::Vector4d sigmas = sigma * Eigen::Vector4d(1, kCrossAxisShare, kCrossAxisShare, 1);
  return sigmas.cwiseAbs2().asDiagonal();
}

MotionByScale motion_by_gradient_scale(const PoseGraphEdge& edge) {
  // Below this norm the rotation turns the sensor upside down, where its split into tilt and twist is
  // undefined.
  constexpr double kUpsideDown = 1e-6;
  const Eigen::Quaterniond q(edge.from_T_to.linear());
  Eigen::Quaterniond twist(q.w(), 0, 0, q.z());
  twist = twist.norm() > kUpsideDown ? twist.normalized() : Eigen::Quaterniond::Identity();
  const Eigen::Vector3d tilt = so3_log((q * twist.conjugate()).toRotationMatrix());
  const std::array<Eigen::Vector3d, kScaleTerms> tilt_by_factor = {
      Eigen::Vector3d(0, -tilt.y(), 0), Eigen::Vector3d(0, tilt.x(), 0), Eigen::Vector3d(tilt.y(), 0, 0),
      Eigen::Vector3d(-tilt.x(), 0, 0)};
  const Eigen::Vector3d& center = edge.shared_center_mm;
  const Eigen::Vector3d flatter =
      0.5 * (Eigen::Vector3d(0, 0, center.z()) -
             (edge.from_T_to * center).z() * edge.from_T_to.linear().row(2).transpose());
  MotionByScale result;
  for (int term = 0; term < kScaleTerms; ++term) {
    // exp(tilt + d) = exp(tilt) exp(J_r(tilt) d), with the right Jacobian J_r(tilt) = V(-tilt). se3_exp()
    // maps (-tilt, d) to the translation V(-tilt) d, and so computes this product.
    Vector6d of_tilt;
    of_tilt << -tilt, tilt_by_factor[index(term)];
    const Eigen::Vector3d turn = twist.conjugate() * se3_exp(of_tilt).translation();
    const bool is_scale = term == 0 || term == kScaleTerms - 1;
    result.col(term) << turn, center.cross(turn) + (is_scale ? flatter : Eigen::Vector3d::Zero());
  }
  return result;
}

SharedUnknowns gradient_scale_unknowns(const std::vector<PoseGraphEdge>& edges, double sigma) {
  SharedUnknowns shared;
  shared.edge_by_unknown.reserve(edges.size());
  for (const PoseGraphEdge& edge : edges) shared.edge_by_unknown.push_back(motion_by_gradient_scale(edge));
  shared.information = prior_scale_covariance(sigma).diagonal().cwiseInverse().asDiagonal();
  return shared;
}

PoseGraphSolution solve_with_gradient_scale(const std::map<int, Pose>& initial,
                                            const std::vector<PoseGraphEdge>& edges,
                                            const PoseGraphOptions& options, double sigma) {
  // Loops contradict each other for reasons other than the scale, too, and four free factors always explain
  // some part of the cost. Where estimating them made a map worse, they explained at most a sixth of it. With
  // networks that read slopes too steep or too flat, they explained more.
  constexpr double kMinExplained = 0.2;  // Least relative decrease of the robust cost.
  PoseGraphSolution first = solve_pose_graph(initial, edges, options);
  std::vector<PoseGraphEdge> agreed = edges;
  for (std::size_t i = 0; i < edges.size(); ++i)
    if (!first.edge_outlier[i])
      agreed[i].from_T_to =
          first.component_T_node.at(edges[i].from).inverse() * first.component_T_node.at(edges[i].to);
  PoseGraphSolution scaled =
      solve_pose_graph(first.component_T_node, edges, options, gradient_scale_unknowns(agreed, sigma));
  return scaled.final_cost < (1 - kMinExplained) * first.final_cost ? scaled : first;
}

Matrix6d UncertainMotion::total_covariance(const ScaleCovariance& scale) const {
  return from_T_to.covariance + by_scale * scale * by_scale.transpose();
}

UncertainMotion UncertainMotion::corrected(const Eigen::VectorXd& factors) const {
  UncertainMotion result = *this;
  if (factors.size() > 0) result.from_T_to.pose = from_T_to.pose * se3_exp(by_scale * factors);
  return result;
}

UncertainMotion uncertain_motion(const PoseGraphEdge& edge) {
  return {{edge.from_T_to, with_overlap_prior(edge.information).inverse()}, motion_by_gradient_scale(edge)};
}

bool constrains_pose(const PoseGraphEdge& edge) {
  constexpr double kMaxSigmaMm = 2.5, kMaxSigmaRad = 0.17;
  const Matrix6d covariance = uncertain_motion(edge).from_T_to.covariance;
  Eigen::Matrix<double, 3, 6> at_center;
  at_center << -skew(edge.shared_center_mm), Eigen::Matrix3d::Identity();
  return worst_sigma(at_center * covariance * at_center.transpose()) <= kMaxSigmaMm &&
         worst_sigma(covariance.topLeftCorner<3, 3>()) <= kMaxSigmaRad;
}

UncertainMotion compose(const UncertainMotion& a, const UncertainMotion& b) {
  const Matrix6d to_end = adjoint(b.from_T_to.pose.inverse());
  return {compose(a.from_T_to, b.from_T_to), to_end * a.by_scale + b.by_scale};
}

std::function<std::optional<UncertainPose>(int from, int to)> motions_between(
    const std::vector<PoseGraphEdge>& edges, const std::vector<bool>& outlier, double gradient_scale_sigma) {
  if (outlier.size() != edges.size()) throw Error("pose graph: the solution is of other edges");
  std::vector<UncertainMotion> motions;
  std::vector<std::size_t> chosen;
  for (std::size_t i = 0; i < edges.size(); ++i) {
    motions.push_back(uncertain_motion(edges[i]));
    if (!outlier[i]) chosen.push_back(i);
  }
  return [scale = prior_scale_covariance(gradient_scale_sigma),
          forest = MotionForest(edges, motions, chosen)](int from, int to) -> std::optional<UncertainPose> {
    if (const int tree = forest.tree(from); tree < 0 || tree != forest.tree(to)) return std::nullopt;
    const UncertainMotion path = forest.path(from, to);
    return UncertainPose{path.from_T_to.pose, path.total_covariance(scale)};
  };
}

}  // namespace gelslam
