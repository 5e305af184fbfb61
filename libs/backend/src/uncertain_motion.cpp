#include "gelslam/backend/uncertain_motion.hpp"

#include <Eigen/Eigenvalues>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <limits>
#include <map>

#include "gelslam/core/gradient_model.hpp"
#include "motion_forest.hpp"
#include "gelslam/core/ablated.hpp"

namespace gelslam {

using namespace backend::detail;

namespace {

/// What the edge would measure with slopes corrected by these factors.
Pose corrected_motion(const PoseGraphEdge& edge, const Eigen::Vector4d& factor) {
  constexpr double kUpsideDown = 1e-6;  // there the split into tilt and twist is not defined
  const Eigen::Quaterniond q(edge.from_T_to.linear());
  Eigen::Quaterniond twist(q.w(), 0, 0, q.z());
  twist = twist.norm() > kUpsideDown ? twist.normalized() : Eigen::Quaterniond::Identity();
  const Eigen::Vector3d tilt = so3_log((q * twist.conjugate()).toRotationMatrix());
  const double xx = factor[0], xy = factor[1], yx = factor[2], yy = factor[3];
  const Eigen::Vector3d corrected_tilt(tilt.x() - yy * tilt.x() + yx * tilt.y(),
                                       tilt.y() - xx * tilt.y() + xy * tilt.x(), tilt.z());
  const Eigen::Vector3d depth_scale(1.0, 1.0, 1.0 - (xx + yy) / 2);

  const Eigen::Vector3d center_in_from = edge.from_T_to * edge.shared_center_mm;
  Pose corrected = Pose::Identity();
  corrected.linear() = so3_exp(corrected_tilt) * twist.toRotationMatrix();
  corrected.translation() = center_in_from.cwiseProduct(depth_scale) -
                            corrected.linear() * edge.shared_center_mm.cwiseProduct(depth_scale);
  return corrected;
}

/// Inverse information; what an edge says nothing about is known to a radian and to the sensor's width, as in
/// whitening_matrix().
Matrix6d covariance_of(const Matrix6d& information) {
  constexpr double kWeakestPerMm2 = 1.0 / (20.0 * 20.0);
  Matrix6d padded = information;
  padded.diagonal() += (Vector6d() << 1, 1, 1, kWeakestPerMm2, kWeakestPerMm2, kWeakestPerMm2).finished();
  return padded.inverse();
}

}  // namespace

MotionByScale motion_by_gradient_scale(const PoseGraphEdge& edge) {
  constexpr double kStep = 1e-3;
  MotionByScale result;
  for (int term = 0; term < kScaleTerms; ++term) {
    const Eigen::Vector4d step = kStep * Eigen::Vector4d::Unit(term);
    const Pose before = corrected_motion(edge, -step), after = corrected_motion(edge, step);
    result.col(term) = se3_log(before.inverse() * after) / (2 * kStep);
  }
  return result;
}

Eigen::Vector4d scale_sigmas(double sigma) {
  const double cross = ablated("cross_axes") ? 1e-6 : kCrossAxisShare;
  return sigma * Eigen::Vector4d(1, cross, cross, 1);
}

SharedUnknowns gradient_scale_unknowns(const std::vector<PoseGraphEdge>& edges, double sigma) {
  SharedUnknowns shared;
  shared.edge_by_unknown.reserve(edges.size());
  for (const PoseGraphEdge& edge : edges) shared.edge_by_unknown.push_back(motion_by_gradient_scale(edge));
  shared.information = scale_sigmas(sigma).cwiseAbs2().cwiseInverse().asDiagonal();
  shared.mean = Eigen::Vector4d::Zero();
  return shared;
}

std::vector<PoseGraphEdge> scale_corrected(std::vector<PoseGraphEdge> edges, const Eigen::VectorXd& factors) {
  if (factors.size() == 0) return edges;
  for (PoseGraphEdge& edge : edges)
    edge.from_T_to = edge.from_T_to * se3_exp(motion_by_gradient_scale(edge) * factors);
  return edges;
}

PoseGraphSolution solve_with_gradient_scale(const std::map<int, Pose>& initial,
                                            const std::vector<PoseGraphEdge>& edges,
                                            const PoseGraphOptions& options, double sigma) {
  const PoseGraphSolution first = solve_pose_graph(initial, edges, options);
  std::vector<PoseGraphEdge> agreed = edges;
  for (std::size_t i = 0; i < edges.size(); ++i)
    if (!first.edge_outlier[i])
      agreed[i].from_T_to =
          first.component_T_node.at(edges[i].from).inverse() * first.component_T_node.at(edges[i].to);
  return solve_pose_graph(first.component_T_node, edges, options, gradient_scale_unknowns(agreed, sigma));
}

Matrix6d UncertainMotion::total_covariance(double gradient_scale_sigma) const {
  const MotionByScale sigma = by_scale * scale_sigmas(gradient_scale_sigma).asDiagonal();
  return covariance + sigma * sigma.transpose() + by_membrane_bias * by_membrane_bias.transpose();
}

UncertainMotion uncertain_motion(const PoseGraphEdge& edge) {
  return {edge.from_T_to, covariance_of(edge.information), motion_by_gradient_scale(edge), Vector6d::Zero()};
}

UncertainMotion compose(const UncertainMotion& a, const UncertainMotion& b) {
  const Matrix6d to_end = adjoint(b.from_T_to.inverse());
  return {a.from_T_to * b.from_T_to, to_end * a.covariance * to_end.transpose() + b.covariance,
          to_end * a.by_scale + b.by_scale, to_end * a.by_membrane_bias + b.by_membrane_bias};
}

UncertainMotion inverse(const UncertainMotion& motion) {
  // (T exp(n))^-1 = T^-1 exp(-Ad(T) n)
  const Matrix6d to_start = adjoint(motion.from_T_to);
  return {motion.from_T_to.inverse(), to_start * motion.covariance * to_start.transpose(),
          -to_start * motion.by_scale, -to_start * motion.by_membrane_bias};
}

struct MotionCertainty::Impl {
  std::map<int, int> node_of;
  MotionForest forest;
  double gradient_scale_sigma;
};

MotionCertainty::MotionCertainty(const std::vector<PoseGraphEdge>& edges, double gradient_scale_sigma) {
  std::map<int, int> node_of;
  std::vector<UncertainMotion> motions;
  std::vector<MotionForest::Edge> links;
  motions.reserve(edges.size());
  const auto number = [&](int id) {
    return node_of.try_emplace(id, static_cast<int>(node_of.size())).first->second;
  };
  for (const PoseGraphEdge& edge : edges) {
    motions.push_back(uncertain_motion(edge));
    links.push_back({number(edge.from), number(edge.to), &motions.back()});
  }
  const int nodes = static_cast<int>(node_of.size());
  impl_.reset(new Impl{std::move(node_of), MotionForest(nodes, links), gradient_scale_sigma});
}

MotionCertainty::~MotionCertainty() = default;

double MotionCertainty::sigma_mm(int from, int to) const {
  const auto a = impl_->node_of.find(from), b = impl_->node_of.find(to), none = impl_->node_of.end();
  if (a == none || b == none || impl_->forest.tree(a->second) != impl_->forest.tree(b->second))
    return std::numeric_limits<double>::infinity();
  const UncertainMotion path = impl_->forest.path(a->second, b->second);
  const Eigen::Matrix3d covariance =
      path.total_covariance(impl_->gradient_scale_sigma).bottomRightCorner<3, 3>();
  return std::sqrt(
      std::max(Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d>(covariance).eigenvalues().maxCoeff(), 0.0));
}

}  // namespace gelslam
